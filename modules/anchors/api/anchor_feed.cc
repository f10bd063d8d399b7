#include "anchors/api/anchor_feed.h"

#include <set>
#include <utility>

#include "anchors/anchor_updates.h"

namespace pangea {

bool AnchorFeed::IsOther(const ListedAnchor& a, const ListedAnchor& b) {
  const Vector6d moved = a.state.T_odom_anchor.Minus(b.state.T_odom_anchor);
  return a.placed != b.placed || a.state.revision != b.state.revision ||
         a.state.edited_by != b.state.edited_by || a.state.group != b.state.group ||
         moved.head<3>().norm() > kAnchorMoved_m || moved.tail<3>().norm() > kAnchorMoved_rad;
}

void AnchorFeed::Set(const AnchorId& id, std::optional<ListedAnchor> newest) {
  Entry& entry = entries_[id];
  by_version_.erase(entry.version);
  entry = {++version_, std::move(newest)};
  by_version_.emplace(entry.version, id);
}

void AnchorFeed::Refresh() {
  if (now_utime_ < next_utime_) {
    return;
  }
  next_utime_ = now_utime_ + kInterval_us;
  std::set<AnchorId> there;
  for (ListedAnchor& anchor : ListAnchors(anchors_)) {
    const AnchorId id = anchor.state.anchor;
    there.insert(id);
    const auto known = entries_.find(id);
    if (known == entries_.end() || !known->second.newest ||
        IsOther(anchor, *known->second.newest)) {
      Set(id, std::move(anchor));
    }
  }
  for (const auto& [id, entry] : entries_) {
    if (entry.newest && !there.contains(id)) {
      Set(id, std::nullopt);
    }
  }
}

std::optional<AnchorFeed::Change> AnchorFeed::After(int64_t seen, int64_t since) {
  Refresh();
  for (auto it = by_version_.upper_bound(seen); it != by_version_.end(); ++it) {
    const auto& [version, id] = *it;
    if (const auto& newest = entries_.at(id).newest) {
      nlohmann::json said = ToJson(*newest);
      said["type"] = "anchor";
      return Change{version, ToText(said)};
    }
    if (version > since) {
      return Change{version, ToText({{"type", "gone"}, {"id", ToString(id)}})};
    }
  }
  return std::nullopt;
}

std::optional<std::vector<uint8_t>> AnchorListener::Next() {
  const auto change = feed_.After(seen_, since_);
  if (!change) {
    return std::nullopt;
  }
  seen_ = change->version;
  return std::vector<uint8_t>(change->json.begin(), change->json.end());
}

}  // namespace pangea
