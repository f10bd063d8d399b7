#pragma once

// The state of the window filter, and how an error of it looks.
//
// Errors are right-invariant: a rotation error dtheta is on the LEFT (R = Exp(dtheta) R^) and every
// vector that lives in odom is carried along by it (p = Exp(dtheta) p^ + xi). In these coordinates
// the four directions that camera and IMU cannot observe, the global position and yaw, are the same
// wherever the state is linearised, so updates gain no information about them (Barrau & Bonnabel,
// "The invariant extended Kalman filter as a stable observer", 2017; Zhang et al., RA-L 2017).
// Landmarks are anchored in a camera of the window and need no such care.

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <vector>

#include "common/preintegration.h"
#include "common/rigid3.h"

namespace pangea::vio {

// Layout of the error state.
inline constexpr int kTheta = 0, kPosition = 3, kVelocity = 6, kGyroBias = 9, kAccelBias = 12;
inline constexpr int kExtrinsics = 15;  // rotation (left), translation of T_body_cam
inline constexpr int kTimeOffset = 21;
inline constexpr int kFixedSize = 22;
inline constexpr int kCloneSize = 6;  // (dtheta, xi_p)
inline constexpr int kLandmarkSize =
    3;  // (alpha, beta, rho): ray and inverse depth in the anchor's camera

struct ImuState {
  Rigid3 T_odom_body;
  Eigen::Vector3d v_odom_body = Eigen::Vector3d::Zero();
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_bias = Eigen::Vector3d::Zero();
};

// A camera pose of the window.
struct Clone {
  int64_t utime = 0;  // of its frame
  Rigid3 T_odom_body;
  Eigen::Vector3d v_odom_body =
      Eigen::Vector3d::Zero();  // when it was made; not part of the error state
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_bias = Eigen::Vector3d::Zero();
  bool is_keyframe = false;
  bool is_edge_end = false;  // a finished keyframe, kept only until the next one's edge is known
};

// A point by its ray (alpha, beta, 1) and inverse depth rho in the anchor clone's camera.
struct AnchoredPoint {
  int64_t anchor_utime = 0;
  Eigen::Vector3d ray_rho = Eigen::Vector3d::Zero();
  Eigen::Vector3d InCamera() const {
    return {ray_rho.x() / ray_rho.z(), ray_rho.y() / ray_rho.z(), 1 / ray_rho.z()};
  }
};

struct WindowState {
  ImuState imu;
  Rigid3 T_body_cam;
  double time_offset_s = 0;                                  // t_imu = t_image + time_offset_s
  std::vector<Clone> clones;                                 // oldest first
  std::vector<std::pair<int32_t, AnchoredPoint>> landmarks;  // by landmark id, in order of entry
  Eigen::MatrixXd covariance;

  int CloneOffset(int index) const { return kFixedSize + kCloneSize * index; }
  int LandmarkOffset(int index) const {
    return kFixedSize + kCloneSize * static_cast<int>(clones.size()) + kLandmarkSize * index;
  }
  int size() const { return LandmarkOffset(static_cast<int>(landmarks.size())); }
  int CloneIndex(int64_t utime) const;           // -1 if it is not there
  int LandmarkIndex(int32_t landmark_id) const;  // -1 if it is not there

  // state (+) error, in the coordinates above.
  void Retract(const Eigen::VectorXd& error);
};

}  // namespace pangea::vio
