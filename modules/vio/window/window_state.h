#pragma once

// The variables of the sliding window, and the parametrisation of their error.
//
// Errors are right-invariant: a rotation error dtheta is on the LEFT (R = Exp(dtheta) R^) and every
// vector that lives in odom is carried along by it (p = Exp(dtheta) p^ + xi). In these coordinates
// the four directions that camera and IMU cannot observe, the global position and yaw, are the same
// wherever a factor is linearised, so a prior linearised long ago gains no information about them
// (Barrau & Bonnabel, "The invariant extended Kalman filter as a stable observer", 2017; Zhang et
// al., RA-L 2017). Landmarks are anchored in a camera of the window and need no such care.

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/camera_model.h"
#include "core/imu/imu_factor.h"
#include "core/imu/preintegration.h"
#include "core/rigid3.h"
#include "vio/imu/body_motion.h"
#include "vio/imu/imu_intrinsics.h"

namespace pangea::vio {

// The order of one frame's error is that in core/imu/imu_factor.h.
inline constexpr int kPoseSize = 6;  // (dtheta, xi_p)
// If stamps jitter, the error of the frame's stamp follows.
inline constexpr int kStampError = kFrameSize;
// The calibration's error comes first: rotation (left) and translation of T_body_cam, time offset,
// intrinsics, interval share.
inline constexpr int kExtrinsics = 0, kTimeOffset = 6, kIntrinsics = 7, kIntervalShare = 12;
inline constexpr int kIntrinsicsSize = 5, kCalibrationSize = 13;
// Then the IMU intrinsics, and then the frames.
inline constexpr int kImuIntrinsics = kCalibrationSize;
inline constexpr int kSharedSize = kCalibrationSize + kImuIntrinsicsSize;

using Intrinsics = Eigen::Matrix<double, kIntrinsicsSize, 1>;

// A frame of the window: the state of the body at the image's time, by the time offset that was
// estimated when the frame was added.
struct WindowFrame {
  int64_t utime = 0;         // of its TrackedFrame
  int64_t imu_utime = 0;     // utime + time_offset_s
  double time_offset_s = 0;  // WindowState::TimeOffsetOf(*this) when the frame was added
  // By how much the interval between images exceeds that at the start (image_stamps.h).
  double excess_interval_s = 0;
  // The image was taken this much later than its stamp says (estimate and sigma; image_stamps.h).
  double stamp_error_s = 0;
  double stamp_sigma_s = 0;  // 0: stamps are exact, stamp_error_s is no variable
  ImuState imu;
  // Motion of the body while the rows are read out (body_motion.h).
  Eigen::Vector3d omega_body = Eigen::Vector3d::Zero();  // rad/s
  Eigen::Vector3d alpha_body = Eigen::Vector3d::Zero();  // rad/s^2
  Eigen::Vector3d a_body = Eigen::Vector3d::Zero();      // m/s^2, without gravity
  bool is_window_keyframe = false;  // keeps its place; else the next frame replaces it
  bool is_keyframe = false;         // it is, or will be, published
  bool is_published = false;
  // Velocity and biases are marginalised; the pose begins the next odometry edge
  bool pose_only = false;
  bool stationary = false;
  bool is_tracked = true;  // its rays are used: they are more than noise

  bool has_stamp_error() const { return !pose_only && stamp_sigma_s > 0; }
  int size() const { return pose_only ? kPoseSize : kFrameSize + (has_stamp_error() ? 1 : 0); }
};

// Whether the state and the motion during the read-out are numbers.
bool IsFinite(const WindowFrame& frame);

struct WindowState {
  Rigid3 T_body_cam;
  double time_offset_s = 0;  // t_imu = t_image + time_offset_s
  // d(time offset) / d(interval between images). For a camera that exposes during the whole
  // interval it is -1/2 if the stamp is at the end of the exposure, 1/2 if it is at the start; it
  // is 0 if the stamp is at the middle or the exposure is short.
  double interval_share = 0;
  // Corrections of the given camera: relative change of the focal length, shift of the principal
  // point in focal lengths (x, y), and change of the first two (radial) distortion coefficients.
  Intrinsics intrinsics = Intrinsics::Zero();
  ImuIntrinsics imu_intrinsics;
  std::vector<WindowFrame> frames;  // oldest first

  int FirstRow(int frame) const;  // of the frame's errors in the window's error vector
  int size() const { return FirstRow(static_cast<int>(frames.size())); }
  int Newest() const { return static_cast<int>(frames.size()) - 1; }
  std::optional<int> Find(int64_t utime) const;
  // `given` with the estimated extrinsics, time offset, focal length, principal point and
  // distortion.
  CameraModel Calibrated(CameraModel given) const;

  double TimeOffsetAt(double excess_interval_s) const {
    return time_offset_s + interval_share * excess_interval_s;
  }
  double TimeOffsetOf(const WindowFrame& frame) const {
    return TimeOffsetAt(frame.excess_interval_s);
  }
  // The time, in seconds after the frame's state, at which a row was exposed that is exposed
  // `row_s` after the image's time. PoseAhead and MotionAhead extrapolate the frame's state to such
  // a time.
  double Ahead(int frame, double row_s) const {
    const WindowFrame& f = frames[frame];
    return TimeOffsetOf(f) - f.time_offset_s + f.stamp_error_s + row_s;
  }
  Rigid3 PoseAhead(int frame, double ahead_s) const;
  BodyMotion MotionAhead(int frame, double ahead_s) const;

  // state (+) error, in the coordinates above.
  void Retract(const Eigen::VectorXd& error);
};

// a (-) b: b.Retract(Difference(a, b)) gives a. `a` has at least the frames of b, in the same
// order.
Eigen::VectorXd Difference(const WindowState& a, const WindowState& b);

}  // namespace pangea::vio
