#include "anchors/anchor_registry.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

namespace pangea {
namespace {

bool Allowed(const AnchorEdit& edit) {
  return edit.right == AnchorRight::kEditAll ||
         (edit.right == AnchorRight::kEditOwn && edit.anchor.agent_id == edit.agent_id);
}

using Order = std::pair<int64_t, int32_t>;
Order OrderOf(const AnchorEdit& edit) { return {edit.revision, edit.agent_id}; }

}  // namespace

std::string AnchorRegistry::Take(const AnchorEdit& edit) {
  if (!Allowed(edit)) {
    return "anchor edit: the editor's key does not allow it";
  }
  if (!entries_.contains(edit.anchor) && entries_.size() - num_deleted_ >= max_anchors_) {
    return fmt::format("anchor edit: there are {} anchors, max_anchors", max_anchors_);
  }
  AnchorEntry& entry = entries_[edit.anchor];
  if (OrderOf(edit) > Order(entry.revision, entry.edited_by)) {
    entry.revision = edit.revision;
    entry.edited_by = edit.agent_id;
    entry.name = edit.name;
    entry.payload = edit.payload;
  }
  if (edit.placement != AnchorEdit::Placement::kSame) {
    entry.places.emplace(OrderOf(edit), edit);
    const auto certain = std::find_if(
        entry.places.rbegin(), entry.places.rend(),
        [](const auto& place) { return place.second.placement != AnchorEdit::Placement::kPixel; });
    if (certain != entry.places.rend()) {
      entry.places.erase(entry.places.begin(), std::prev(certain.base()));
    }
  }
  num_deleted_ += edit.deleted && !entry.deleted ? 1 : 0;
  entry.deleted |= edit.deleted;
  return "";
}

}  // namespace pangea
