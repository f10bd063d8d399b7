#pragma once

// Limits the odometry drift between two keyframes of one map. The limits are generous: a gate
// against look-alikes at the other end of a hall, not an estimate of the drift.

#include <string>
#include <utility>

#include "core/rigid3.h"

namespace pangea {

struct DriftGateOptions {
  double max_drift_m = 1.0;      // for a path of length 0
  double max_drift_share = 0.1;  // of the path between the keyframes
  double max_yaw = 0.15;         // radians, for a path of length 0
  double max_yaw_per_m = 0.01;   // radians per metre of path

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Add("max_drift_m", &max_drift_m, {0, 10000}, "m", "however short the path");
    archive.Add("max_drift_share", &max_drift_share, {0, 10}, "",
                "of the path between the keyframes");
    archive.Add("max_yaw", &max_yaw, {0, 3.15}, "rad", "however short the path");
    archive.Add("max_yaw_per_m", &max_yaw_per_m, {0, 3.15}, "rad/m", "of path");
  }
};

// For two keyframes of one map, `path_m` apart along its odometry; the newer one (c) is at
// `p_odom_c`.
class DriftGate {
 public:
  DriftGate(const DriftGateOptions& options, double path_m, Eigen::Vector3d p_odom_c)
      : options_(options), path_m_(path_m), p_odom_c_(std::move(p_odom_c)) {}

  // The reason of a refusal, or an empty string. `T_odom_m_odom_c`: drift of the odometry from the
  // older keyframe (m) to the newer one.
  std::string Check(const Rigid3& T_odom_m_odom_c) const;

 private:
  DriftGateOptions options_;
  double path_m_;
  Eigen::Vector3d p_odom_c_;
};

}  // namespace pangea
