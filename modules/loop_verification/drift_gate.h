#pragma once

// Limits the odometry drift between two keyframes of one map. The limits are generous: a gate
// against look-alikes at the other end of a hall, not an estimate of the drift.

#include <string>

#include "loop_verification/steps/verification.h"

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

// For two keyframes of one map, `path_m` apart along its odometry. The gate's argument
// T_odom_m_odom_c is the drift of the odometry from the older keyframe (m) to the newer one (c),
// which is at `p_odom_c`.
LoopVerificationGate MakeDriftGate(const DriftGateOptions& options, double path_m,
                                   const Eigen::Vector3d& p_odom_c);

}  // namespace pangea
