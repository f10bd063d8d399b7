#include "loop_verification/drift_gate.h"

#include <cmath>

namespace pangea {

LoopVerificationGate MakeDriftGate(const DriftGateOptions& options, double path_m,
                                   const Eigen::Vector3d& p_odom_c) {
  return [=](const Rigid3& T_odom_m_odom_c) -> std::string {
    const double drift_m = (T_odom_m_odom_c * p_odom_c - p_odom_c).norm();
    const double yaw = std::abs(YawOf(T_odom_m_odom_c.q));
    const bool possible = drift_m < options.max_drift_m + options.max_drift_share * path_m &&
                          yaw < options.max_yaw + options.max_yaw_per_m * path_m;
    return possible ? "" : "more drift than odometry makes";
  };
}

}  // namespace pangea
