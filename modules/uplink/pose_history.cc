#include "uplink/pose_history.h"

#include <algorithm>
#include <iterator>

namespace pangea {
namespace {

Rigid3 Between(const Rigid3& a, const Rigid3& b, double share) {
  return {a.q.slerp(share, b.q), a.t + share * (b.t - a.t)};
}

double Share(int64_t utime, int64_t from, int64_t to) {
  return static_cast<double>(utime - from) / static_cast<double>(to - from);
}

// The first item at or after that time.
template <typename Stamped>
typename std::deque<Stamped>::const_iterator FirstFrom(const std::deque<Stamped>& items,
                                                       int64_t utime) {
  return std::lower_bound(items.begin(), items.end(), utime,
                          [](const Stamped& item, int64_t time) { return item.utime < time; });
}

}  // namespace

void PoseHistory::Open(const MapId& map) {
  if (map != map_) {
    poses_.clear();
    corrections_.clear();
    map_ = map;
  }
}

void PoseHistory::AddPose(int64_t utime, const MapId& map, const Rigid3& T_odom_body) {
  Open(map);
  if (!poses_.empty() && utime <= poses_.back().utime) {
    return;
  }
  poses_.push_back({utime, T_odom_body});
  while (poses_.size() > kMaxPoses || utime - poses_.front().utime > kLength_us) {
    poses_.pop_front();
  }
}

void PoseHistory::AddKeyframe(int64_t utime, const MapId& map, const Rigid3& T_odom_body) {
  auto live = map == map_ ? Live(utime) : std::nullopt;
  if (!live || (!corrections_.empty() && utime <= corrections_.back().utime)) {
    return;  // a repeat, or older than the poses that are kept
  }
  corrections_.push_back({utime, T_odom_body * live->Inverse()});
  while (utime - corrections_.front().utime > kLength_us) {
    corrections_.pop_front();
  }
}

std::optional<Rigid3> PoseHistory::Live(int64_t utime) const {
  const auto after = FirstFrom(poses_, utime);
  if (after == poses_.end()) {
    return std::nullopt;
  }
  if (after->utime == utime) {
    return after->T_odom_body;
  }
  if (after == poses_.begin() || after->utime - std::prev(after)->utime > kMaxGap_us) {
    return std::nullopt;
  }
  const Entry& before = *std::prev(after);
  return Between(before.T_odom_body, after->T_odom_body, Share(utime, before.utime, after->utime));
}

std::optional<Rigid3> PoseHistory::At(int64_t utime, const MapId& map) const {
  auto live = map == map_ ? Live(utime) : std::nullopt;
  if (!live || corrections_.empty()) {
    return live;
  }
  const auto after = FirstFrom(corrections_, utime);
  if (after == corrections_.begin()) {
    return after->T_odom_live * *live;
  }
  const Rigid3 by_before = std::prev(after)->T_odom_live * *live;
  if (after == corrections_.end()) {
    return by_before;
  }
  return Between(by_before, after->T_odom_live * *live,
                 Share(utime, std::prev(after)->utime, after->utime));
}

bool PoseHistory::IsSettled(int64_t utime, const MapId& map) const {
  return map == map_ && !corrections_.empty() && corrections_.back().utime >= utime;
}

}  // namespace pangea
