#include "uplink/pose_history.h"

#include <algorithm>
#include <iterator>

namespace pangea {

void PoseHistory::Add(int64_t utime, const MapId& map, const Rigid3& T_odom_body) {
  if (map != map_ || (!poses_.empty() && utime <= poses_.back().utime)) {
    poses_.clear();
    map_ = map;
  }
  poses_.push_back({utime, T_odom_body});
  while (poses_.size() > kMaxPoses || utime - poses_.front().utime > kLength_us) {
    poses_.pop_front();
  }
}

std::optional<Rigid3> PoseHistory::At(int64_t utime, const MapId& map) const {
  const auto after = std::ranges::lower_bound(poses_, utime, {}, &Entry::utime);
  if (map != map_ || after == poses_.end()) {
    return std::nullopt;
  }
  if (after->utime == utime) {
    return after->T_odom_body;
  }
  if (after == poses_.begin()) {
    return std::nullopt;
  }
  const Entry& before = *std::prev(after);
  const int64_t gap_us = after->utime - before.utime;
  if (gap_us > kMaxGap_us) {
    return std::nullopt;
  }
  const double share = static_cast<double>(utime - before.utime) / static_cast<double>(gap_us);
  const Eigen::Vector3d t =
      before.T_odom_body.t + share * (after->T_odom_body.t - before.T_odom_body.t);
  return Rigid3(before.T_odom_body.q.slerp(share, after->T_odom_body.q), t);
}

}  // namespace pangea
