#include "vio/live/shown_pose.h"

#include <algorithm>

namespace pangea::vio {

void ShownPose::Reset(const MapId& map) {
  *this = ShownPose{};
  map_ = map;
  group_ = map;
}

bool ShownPose::Correct(const Correction& correction) {
  if (correction.map != map_ || correction.revision <= revision_) {
    return false;
  }
  revision_ = correction.revision;
  target_ = correction.T_map_odom;
  if (correction.group != group_) {
    group_ = correction.group;
    shown_ = target_;
  }
  return true;
}

Rigid3 ShownPose::Show(int64_t utime, const Rigid3& T_odom_body) {
  const double dt = last_utime_ ? 1e-6 * static_cast<double>(utime - *last_utime_) : 0.0;
  last_utime_ = utime;
  // The remaining correction of the body pose: a rotation about the body and a shift, so that a
  // distant odom origin is no lever.
  const Rigid3 now = shown_ * T_odom_body;
  const Rigid3 wanted = target_ * T_odom_body;
  const Eigen::Vector3d rotation = LogSo3(wanted.q * now.q.conjugate());
  const Eigen::Vector3d move = wanted.t - now.t;
  const double rotation_share = std::min(1.0, kMaxYawRate * dt / std::max(rotation.norm(), 1e-12));
  const double move_share = std::min(1.0, kMaxSpeed * dt / std::max(move.norm(), 1e-12));
  Rigid3 shown{(ExpSo3(rotation_share * rotation) * now.q).normalized(), now.t + move_share * move};
  shown_ = shown * T_odom_body.Inverse();
  return shown;
}

}  // namespace pangea::vio
