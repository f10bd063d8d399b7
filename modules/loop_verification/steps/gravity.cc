#include "loop_verification/steps/gravity.h"

#include <Eigen/Cholesky>

namespace pangea {

double TiltVariance(const WindowPair& windows, double floor) {
  double variance = 0;
  for (const Window* window : {&windows.m, &windows.c}) {
    variance += window->newest_keyframe().roll_pitch_covariance.trace() / 2;
  }
  return variance + 2 * floor * floor;
}

std::string CheckGravity(const GravityOptions& options, Verification* verification) {
  const JointBaResult& ba = *verification->ba;
  const Eigen::Vector3d up = ba.T_m_c.q * Eigen::Vector3d::UnitZ();
  const Eigen::Vector2d tilt(-up.y(), up.x());
  const Eigen::Matrix3d R_m_Km =
      verification->windows.m.newest_keyframe().T_odom_body.q.toRotationMatrix();
  const Eigen::Matrix3d visual =
      R_m_Km * ba.covariance.bottomRightCorner<3, 3>() * R_m_Km.transpose();
  const Eigen::Matrix2d covariance =
      visual.topLeftCorner<2, 2>() +
      TiltVariance(verification->windows, options.gravity_floor) * Eigen::Matrix2d::Identity();
  const bool small = verification->AtMost("max_tilt", tilt.norm(), options.max_tilt);
  const bool likely = verification->AtMost("max_tilt_chi2", tilt.dot(covariance.ldlt().solve(tilt)),
                                           options.max_tilt_chi2);
  return small && likely ? "" : "roll or pitch contradicts gravity";
}

}  // namespace pangea
