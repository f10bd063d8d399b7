#include "global_ba/adjusted_group.h"

#include <cmath>

namespace pangea {

const KeyframeState* AdjustedGroup::Find(const KeyframeId& id) const {
  const auto known = keyframes.find(id);
  return known != keyframes.end() && known->second ? &*known->second : nullptr;
}

bool AdjustedGroup::IsShapeOf(const MapPoses& state) const {
  constexpr double kSame_m = 1e-4;
  const Eigen::Vector3d* p_before = nullptr;
  const Eigen::Vector3d* p_state_before = nullptr;
  for (const auto& [id, own] : keyframes) {
    if (!own) {
      continue;
    }
    const auto posed = state.find(id);
    if (posed == state.end()) {
      return false;
    }
    const Eigen::Vector3d& p = own->T_map_body.t;
    const Eigen::Vector3d& p_state = posed->second.t;
    if (p_before != nullptr &&
        std::abs((p_state - *p_state_before).norm() - (p - *p_before).norm()) > kSame_m) {
      return false;
    }
    p_before = &p;
    p_state_before = &p_state;
  }
  return true;
}

KeyframeState MovedTo(const Rigid3& T_map_body, const KeyframeState& adjusted) {
  const Eigen::Quaterniond rotation = T_map_body.q * adjusted.T_map_body.q.conjugate();
  return {T_map_body, rotation * adjusted.v_map_body, adjusted.gyro_bias, adjusted.accel_bias};
}

AdjustedGroup AfterAdjustment(const BaWorld& world, const MapPoses& state,
                              const AdjustedGroup* before) {
  AdjustedGroup after;
  if (before != nullptr) {
    after.cameras = before->cameras;
  }
  for (const auto& [id, T_map_body] : state) {
    const KeyframeState* known = before == nullptr ? nullptr : before->Find(id);
    std::optional<KeyframeState>& own = after.keyframes[id];
    if (known != nullptr) {
      own = MovedTo(T_map_body, *known);
    }
  }
  for (const BaKeyframe& keyframe : world.keyframes) {
    if (!keyframe.fixed) {
      after.keyframes[keyframe.id] = keyframe.state;
    }
    after.cameras[keyframe.id.map] = world.cameras[keyframe.camera];
  }
  return after;
}

}  // namespace pangea
