#pragma once

// Points seen from the window's frames: projection with its derivatives, triangulation. Rays are on
// the plane z = 1; sigmas are in that plane's unit (pixel sigma times the angle of a pixel).

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "vio/window/window_state.h"

namespace pangea::vio {

// An observation of one point in one frame of the window.
struct FrameRay {
  int frame = 0;                                  // index into WindowState::frames
  Eigen::Vector2d ray = Eigen::Vector2d::Zero();  // with the given intrinsics
  double sigma = 0;
  double row_s = 0;  // exposure of the row, after the image's time (rolling shutter)
  // d(ray of the pixel)/d(WindowState::intrinsics), which are small corrections.
  Eigen::Matrix<double, 2, kIntrinsicsSize> J_intrinsics =
      Eigen::Matrix<double, 2, kIntrinsicsSize>::Zero();

  Eigen::Vector2d RayBy(const WindowState& state) const {
    return ray + J_intrinsics * state.intrinsics / (1 + state.intrinsics.x());
  }
  // The inverse, for a predicted ray near this one: the ray with the given intrinsics. The focal
  // length acts on the predicted ray, not on the measured one: with measurement noise in its
  // derivative, the estimate would be biased to a longer focal length, which shrinks the noise
  // (regression dilution).
  Eigen::Vector2d AsGiven(const WindowState& state, const Eigen::Vector2d& predicted) const {
    return predicted - J_intrinsics * state.intrinsics + state.intrinsics.x() * (predicted - ray);
  }
};

// A point as ray (alpha, beta, 1) and inverse depth rho (1/m), in the camera at the time of its
// anchor's row.
struct AnchoredPoint {
  int anchor = 0;  // index into WindowState::frames
  double anchor_row_s = 0;
  Eigen::Vector3d ray_rho = Eigen::Vector3d::Zero();
  Eigen::Vector3d InCamera() const {
    return {ray_rho.x() / ray_rho.z(), ray_rho.y() / ray_rho.z(), 1 / ray_rho.z()};
  }
};

// Pose and velocity of the body when a row was exposed.
struct RowView {
  double row_s = 0, ahead_s = 0;
  Rigid3 T_odom_body;
  Eigen::Matrix3d R_odom_body;
  std::optional<Eigen::Vector3d> v_odom, omega_odom;
};
// Computes RowViews of a window that does not change. The last one of each frame is cached: all
// rays of a global shutter's frame have the same.
class RowViews {
 public:
  explicit RowViews(const WindowState& state) : state_(&state), last_(state.frames.size()) {}
  const WindowState& state() const { return *state_; }
  const RowView& At(int frame, double row_s);
  // Velocity, in odom, of a point rigidly attached to the moving body, m/s.
  Eigen::Vector3d CarriedBy(int frame, double row_s, const Eigen::Vector3d& p_odom);

 private:
  const WindowState* state_;
  std::vector<std::optional<RowView>> last_;
};

// The predicted ray of a point with the given intrinsics, and its Jacobians with respect to the
// errors of the anchor's pose, of the observing frame's pose, of their stamps, of the calibration,
// and of (alpha, beta, rho). If the frame is the anchor, the blocks of the two frames cancel.
struct PredictedRay {
  Eigen::Vector2d ray;
  Eigen::Matrix<double, 2, kPoseSize> J_anchor, J_frame;
  Eigen::Vector2d J_anchor_stamp, J_frame_stamp;
  Eigen::Matrix<double, 2, kCalibrationSize> J_calibration;
  Eigen::Matrix<double, 2, 3> J_point;
};
// The part of a prediction that all rays of a point share: its position in odom, and the Jacobians
// of this position with respect to the errors on the anchor's side.
struct PointInOdom {
  PointInOdom(RowViews& rows, const AnchoredPoint& point);
  Eigen::Vector3d p_odom;
  Eigen::Matrix3d by_point;         // (alpha, beta, rho)
  Eigen::Matrix3d by_rotation;      // of T_body_cam
  Eigen::Matrix3d by_translation;   // of T_body_cam
  Eigen::Vector3d by_anchor_stamp;  // m/s
  double anchor_excess_interval_s = 0;
};
Eigen::Vector3d InOdom(RowViews& rows, const AnchoredPoint& point);
// Empty if the point is behind the camera.
std::optional<Eigen::Vector2d> PredictRayOnly(RowViews& rows, const Eigen::Vector3d& p_odom,
                                              const FrameRay& seen);
std::optional<PredictedRay> PredictRay(RowViews& rows, const PointInOdom& point,
                                       const FrameRay& seen);

struct Triangulated {
  AnchoredPoint point;
  Eigen::Matrix3d covariance;  // of (alpha, beta, rho), for exact poses
  double rms = 0;              // of the whitened residuals
};
// Needs at least two rays; the anchor is the frame of `rays[anchor]`. Empty if the depth is
// undetermined or out of range.
std::optional<Triangulated> Triangulate(const WindowState& state, std::span<const FrameRay> rays,
                                        size_t anchor);

}  // namespace pangea::vio
