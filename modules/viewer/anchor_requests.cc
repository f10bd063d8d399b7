#include "viewer/anchor_requests.h"

#include <algorithm>
#include <utility>

namespace pangea::viewer {
namespace {

using Order = std::pair<int64_t, int32_t>;
Order OrderOf(const AnchorEdit& edit) { return {edit.revision, edit.agent_id}; }

// Whether `ours` has no effect because the journal has `other`. The journal takes one edit of an
// editor for each revision. A deletion is final. If the other edit keeps the place, ours still
// moves the anchor.
bool IsLostTo(const AnchorEdit& other, const AnchorEdit& ours) {
  if (OrderOf(other) == OrderOf(ours)) {
    return !IsSameChange(other, ours);
  }
  return !ours.deleted && (other.deleted || (OrderOf(other) > OrderOf(ours) &&
                                             other.placement != AnchorEdit::Placement::kSame));
}

}  // namespace

bool AnchorRequests::Add(AnchorEdit edit, int64_t now_utime) {
  const auto known = pending_.find(edit.anchor);
  if (known != pending_.end()) {
    edit.revision = std::max(edit.revision, known->second.edit.revision + 1);
  } else if (pending_.size() >= kMaxPending) {
    return false;
  }
  const AnchorId anchor = edit.anchor;
  pending_.insert_or_assign(anchor, Pending{std::move(edit), now_utime, now_utime});
  return true;
}

std::optional<AnchorEdit> AnchorRequests::TakeLost(const AnchorEdit& journalled) {
  const auto known = pending_.find(journalled.anchor);
  if (known == pending_.end() || known->second.journalled) {
    return std::nullopt;
  }
  Pending& ours = known->second;
  if (IsLostTo(journalled, ours.edit)) {
    return std::move(pending_.extract(known).mapped().edit);
  }
  ours.journalled = OrderOf(journalled) == OrderOf(ours.edit);
  return std::nullopt;
}

void AnchorRequests::Shown(const AnchorId& anchor, int64_t revision) {
  const auto known = pending_.find(anchor);
  if (known != pending_.end() && known->second.journalled &&
      revision >= known->second.edit.revision) {
    pending_.erase(known);
  }
}

std::vector<AnchorEdit> AnchorRequests::Due(int64_t now_utime) {
  std::vector<AnchorEdit> due;
  for (auto& [anchor, pending] : pending_) {
    if (!pending.journalled && now_utime >= pending.next_utime) {
      pending.next_utime = now_utime + kInterval_us;
      due.push_back(pending.edit);
    }
  }
  return due;
}

std::vector<AnchorEdit> AnchorRequests::TakeGivenUp(int64_t now_utime) {
  std::vector<AnchorEdit> given_up;
  std::erase_if(pending_, [&](const auto& item) {
    const bool late = now_utime - item.second.since_utime >= kPatience_us;
    if (late && !item.second.journalled) {
      given_up.push_back(item.second.edit);
    }
    return late;
  });
  return given_up;
}

}  // namespace pangea::viewer
