#include "loop_verification/drift_gate.h"

#include <cmath>

namespace pangea {

std::string DriftGate::Check(const Rigid3& T_odom_m_odom_c) const {
  const double drift_m = (T_odom_m_odom_c * p_odom_c_ - p_odom_c_).norm();
  const double yaw = std::abs(YawOf(T_odom_m_odom_c.q));
  const bool possible = drift_m < options_.max_drift_m + options_.max_drift_share * path_m_ &&
                        yaw < options_.max_yaw + options_.max_yaw_per_m * path_m_;
  return possible ? "" : "more drift than odometry makes";
}

}  // namespace pangea
