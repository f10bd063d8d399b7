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
  Eigen::Vector2d ray = Eigen::Vector2d::Zero();  // by the given intrinsics
  double sigma = 0;
  double row_s = 0;  // the row's exposure after the image's time (rolling shutter)
  // d(ray)/d(WindowState::intrinsics), which are small: what the pixel's ray is by other ones.
  Eigen::Matrix<double, 2, kIntrinsicsSize> J_intrinsics =
      Eigen::Matrix<double, 2, kIntrinsicsSize>::Zero();

  Eigen::Vector2d RayBy(const WindowState& state) const {
    return ray + J_intrinsics * state.intrinsics / (1 + state.intrinsics.x());
  }
  // The other way, of a ray near this one: what it is by the given intrinsics. The focal length
  // acts on that ray, not on the measured one: with this one's noise in its derivative a longer
  // focal length would make noise smaller, and be found (regression dilution).
  Eigen::Vector2d AsGiven(const WindowState& state, const Eigen::Vector2d& predicted) const {
    return predicted - J_intrinsics * state.intrinsics + state.intrinsics.x() * (predicted - ray);
  }
};

// A point by its ray (alpha, beta, 1) and inverse depth rho in the camera that took its anchor's
// row.
struct AnchoredPoint {
  int anchor = 0;  // index into WindowState::frames
  double anchor_row_s = 0;
  Eigen::Vector3d ray_rho = Eigen::Vector3d::Zero();
  Eigen::Vector3d InCamera() const {
    return {ray_rho.x() / ray_rho.z(), ray_rho.y() / ray_rho.z(), 1 / ray_rho.z()};
  }
};

// A body when a row was exposed.
struct RowView {
  double row_s = 0, ahead_s = 0;
  Rigid3 T_odom_body;
  Eigen::Matrix3d R_odom_body;
  std::optional<Eigen::Vector3d> v_odom, omega_odom;
};
// Those of a window that does not change; of each frame the last row is kept, as one whose rows are
// all exposed at once has no other.
class RowViews {
 public:
  explicit RowViews(const WindowState& state) : state_(&state), last_(state.frames.size()) {}
  const WindowState& state() const { return *state_; }
  const RowView& At(int frame, double row_s);
  // How fast a point moves that the frame carries along, m/s.
  Eigen::Vector3d CarriedBy(int frame, double row_s, const Eigen::Vector3d& p_odom);

 private:
  const WindowState* state_;
  std::vector<std::optional<RowView>> last_;
};

// Where a point should be seen by the given intrinsics, and d(ray) by the errors of the anchor's
// pose, the seeing frame's pose, their stamps, the calibration, and (alpha, beta, rho). In its own
// anchor the blocks of the two frames cancel.
struct PredictedRay {
  Eigen::Vector2d ray;
  Eigen::Matrix<double, 2, kPoseSize> J_anchor, J_frame;
  Eigen::Vector2d J_anchor_stamp, J_frame_stamp;
  Eigen::Matrix<double, 2, kCalibrationSize> J_calibration;
  Eigen::Matrix<double, 2, 3> J_point;
};
// A point as all its rays need it: where it is in odom, and how the errors of its anchor's side
// move it there.
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
// Nothing when the point is behind the camera.
std::optional<Eigen::Vector2d> PredictRayOnly(RowViews& rows, const Eigen::Vector3d& p_odom,
                                              const FrameRay& seen);
std::optional<PredictedRay> PredictRay(RowViews& rows, const PointInOdom& point,
                                       const FrameRay& seen);

struct Triangulated {
  AnchoredPoint point;
  Eigen::Matrix3d covariance;  // of (alpha, beta, rho), poses taken as exact
  double rms = 0;              // whitened residual
};
// From at least two rays; the anchor is `rays[anchor]`. Nothing when the depth is not determined or
// out of range.
std::optional<Triangulated> Triangulate(const WindowState& state, std::span<const FrameRay> rays,
                                        size_t anchor);

}  // namespace pangea::vio
