#pragma once

// One map point of one window seen by a camera of the other: what PnP, the projection search and
// the pose refinement share.

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "loop_verification/window.h"

namespace pangea {

struct PointMatch {
  Direction direction = Direction::kForward;
  int landmark = 0;    // in the window that holds the point
  CornerRef observed;  // in the other window
  int distance = 0;    // Hamming
};

// A match with the numbers its residual needs.
struct PointObservation {
  Direction direction = Direction::kForward;
  Eigen::Vector3d p_w;            // in the frame of the window that holds the point
  Eigen::Vector3d depth_sigma_w;  // one sigma of its depth
  Rigid3 T_cam_w;                 // the observing camera, in its own window
  Eigen::Vector2d ray;
  Eigen::Matrix2d sqrt_info;  // whitens a difference of rays by the corner's pixel sigma
};

PointObservation MakeObservation(const WindowPair& windows, const PointMatch& match,
                                 double pixel_sigma);

// Residual in sigmas of its pixel, and what one sigma of the point's depth adds to it.
// J, when given: d(residual)/d(xi), xi the tangent of X in the left frame (core/rigid3.h).
struct WhitenedResidual {
  Eigen::Vector2d r;
  Eigen::Vector2d depth_sigma;
};
std::optional<WhitenedResidual> Residual(const PointObservation& observation, const Rigid3& T_m_c,
                                         Eigen::Matrix<double, 2, 6>* J = nullptr);

// The same with the rotations at hand: of T_m_c and of the observation's T_cam_w.
std::optional<WhitenedResidual> Residual(const PointObservation& observation, const Rigid3& T_m_c,
                                         const Eigen::Matrix3d& R_m_c,
                                         const Eigen::Matrix3d& R_cam_w,
                                         Eigen::Matrix<double, 2, 6>* J = nullptr);

// Squared Mahalanobis distance under the pixel noise, `extra_var` more of it (in sigma^2), and the
// depth's uncertainty; infinite behind the camera.
double Chi2(const std::optional<WhitenedResidual>& residual, double extra_var = 0);
inline double Chi2(const PointObservation& observation, const Rigid3& T_m_c, double extra_var = 0) {
  return Chi2(Residual(observation, T_m_c), extra_var);
}

struct PoseEstimate {
  Rigid3 T_m_c;
  Matrix6d covariance = Matrix6d::Identity();
};

// Robust Gauss-Newton over X alone. Gravity's prior: the tilt of X is zero within `tilt_sigma`.
PoseEstimate RefinePose(const std::vector<PointObservation>& observations, const Rigid3& T_m_c,
                        double tilt_sigma);

}  // namespace pangea
