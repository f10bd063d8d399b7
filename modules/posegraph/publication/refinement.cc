#include "posegraph/publication/refinement.h"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace pangea {

Refinement::Refinement(const MapState& refined) : revision_(refined.revision), maps_(refined.maps) {
  std::ranges::sort(maps_);
  for (const KeyframePose& keyframe : refined.keyframes) {
    if (std::ranges::binary_search(maps_, keyframe.id.map)) {
      poses_[keyframe.id] = keyframe.T_map_body;
    }
  }
}

bool Refinement::SharesMapWith(const Refinement& other) const {
  return std::ranges::any_of(
      maps_, [&](const MapId& map) { return std::ranges::binary_search(other.maps_, map); });
}

Pose4 FitYawAndShift(const std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>>& pairs) {
  Eigen::Vector3d to_mean = Eigen::Vector3d::Zero(), from_mean = Eigen::Vector3d::Zero();
  const auto count = static_cast<double>(pairs.size());
  for (const auto& [to, from] : pairs) {
    to_mean += to / count;
    from_mean += from / count;
  }
  double sine = 0, cosine = 0;
  for (const auto& [to, from] : pairs) {
    const Eigen::Vector3d a = from - from_mean, b = to - to_mean;
    sine += a.x() * b.y() - a.y() * b.x();
    cosine += a.x() * b.x() + a.y() * b.y();
  }
  const double yaw = std::atan2(sine, cosine);
  return {to_mean - YawRotation(yaw) * from_mean, yaw};
}

const RefinedMap::Refined* RefinedMap::Before(int node) const {
  if (refined_.empty()) {
    return nullptr;
  }
  const auto after = std::ranges::upper_bound(refined_, node, {}, &Refined::first);
  return after == refined_.begin() ? &*after : &*std::prev(after);
}

Pose4 RefinedMap::Shift(int node) const {
  const Refined* refined = Before(node);
  if (refined == nullptr) {
    return {};
  }
  const auto& [index, T_map_body] = *refined;
  const Eigen::Quaterniond rotation = T_map_body.q * chain_[index].T_odom_body.q.conjugate();
  const Pose4 pose{T_map_body.t, 2 * std::atan2(rotation.z(), rotation.w())};
  return pose * solved_[index].Inverse();
}

Rigid3 RefinedMap::T_map_body(int node) const {
  const Refined* refined = Before(node);
  if (refined != nullptr && refined->first == node) {
    return refined->second;
  }
  const Pose4 pose = Shift(node) * solved_[node];
  return {(YawRotation(pose.yaw) * chain_[node].T_odom_body.q).normalized(), pose.p};
}

}  // namespace pangea
