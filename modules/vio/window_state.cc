#include "vio/window_state.h"

namespace pangea::vio {
namespace {

// R = Exp(dtheta) R^, p = Exp(dtheta) p^ + xi.
Rigid3 RetractInvariant(const Rigid3& T, const Eigen::Vector3d& dtheta, const Eigen::Vector3d& xi) {
  const Eigen::Quaterniond turn = ExpSo3(dtheta);
  return {(turn * T.q).normalized(), turn * T.t + xi};
}

}  // namespace

int WindowState::CloneIndex(int64_t utime) const {
  for (size_t i = 0; i < clones.size(); ++i) {
    if (clones[i].utime == utime) {
      return static_cast<int>(i);
    }
  }
  return -1;
}

int WindowState::LandmarkIndex(int32_t landmark_id) const {
  for (size_t i = 0; i < landmarks.size(); ++i) {
    if (landmarks[i].first == landmark_id) {
      return static_cast<int>(i);
    }
  }
  return -1;
}

void WindowState::Retract(const Eigen::VectorXd& error) {
  const Eigen::Vector3d dtheta = error.segment<3>(kTheta);
  imu.T_odom_body = RetractInvariant(imu.T_odom_body, dtheta, error.segment<3>(kPosition));
  imu.v_odom_body = ExpSo3(dtheta) * imu.v_odom_body + error.segment<3>(kVelocity);
  imu.gyro_bias += error.segment<3>(kGyroBias);
  imu.accel_bias += error.segment<3>(kAccelBias);
  T_body_cam.q = (ExpSo3(error.segment<3>(kExtrinsics)) * T_body_cam.q).normalized();
  T_body_cam.t += error.segment<3>(kExtrinsics + 3);
  time_offset_s += error[kTimeOffset];
  for (size_t i = 0; i < clones.size(); ++i) {
    const int at = CloneOffset(static_cast<int>(i));
    clones[i].T_odom_body =
        RetractInvariant(clones[i].T_odom_body, error.segment<3>(at), error.segment<3>(at + 3));
    // Carried along, so that a keyframe leaves with a velocity of its own attitude.
    clones[i].v_odom_body = ExpSo3(error.segment<3>(at)) * clones[i].v_odom_body;
  }
  for (size_t i = 0; i < landmarks.size(); ++i) {
    landmarks[i].second.ray_rho += error.segment<3>(LandmarkOffset(static_cast<int>(i)));
  }
}

}  // namespace pangea::vio
