#pragma once

// A map point of one window observed by a camera of the other, and its residual; used by PnP, the
// projection search and the pose refinement.

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "loop_verification/window.h"

namespace pangea {

struct PointMatch {
  Direction direction = Direction::kForward;
  int landmark = 0;    // index in the window that holds the point
  CornerRef observed;  // in the other window
  int distance = 0;    // Hamming
};

// A match with the values that its residual needs.
struct PointObservation {
  Direction direction = Direction::kForward;
  Eigen::Vector3d p_w;            // in the frame of the window that holds the point
  Eigen::Vector3d depth_sigma_w;  // displacement by one sigma of its depth
  Rigid3 T_cam_w;                 // the observing camera, in its own window
  Eigen::Matrix3d R_cam_w;        // its rotation
  Eigen::Vector2d ray;
  Eigen::Matrix2d sqrt_info;  // whitens a difference of rays by the corner's pixel sigma
};

PointObservation MakeObservation(const WindowPair& windows, const PointMatch& match,
                                 double pixel_sigma);

// The residual in sigmas of the pixel, and its change by one sigma of the point's depth. Empty if
// the point is behind the camera. J, if not null: d(residual)/d(xi), with xi the perturbation of X
// = T_m_c in the left frame (core/rigid3.h). R_m_c: the rotation of T_m_c.
struct WhitenedResidual {
  Eigen::Vector2d r;
  Eigen::Vector2d depth_sigma;
};
std::optional<WhitenedResidual> Residual(const PointObservation& observation, const Rigid3& T_m_c,
                                         const Eigen::Matrix3d& R_m_c,
                                         Eigen::Matrix<double, 2, 6>* J = nullptr);
inline std::optional<WhitenedResidual> Residual(const PointObservation& observation,
                                                const Rigid3& T_m_c,
                                                Eigen::Matrix<double, 2, 6>* J = nullptr) {
  return Residual(observation, T_m_c, T_m_c.R(), J);
}

// Squared Mahalanobis distance, with the pixel noise, an additional variance `extra_var` (in
// sigma^2), and the uncertainty of the depth. Infinite behind the camera.
double Chi2(const std::optional<WhitenedResidual>& residual, double extra_var = 0);
inline double Chi2(const PointObservation& observation, const Rigid3& T_m_c, double extra_var = 0) {
  return Chi2(Residual(observation, T_m_c), extra_var);
}

struct PoseEstimate {
  Rigid3 T_m_c;
  Matrix6d covariance = Matrix6d::Identity();
};

// Robust Gauss-Newton over X = T_m_c alone, with a gravity prior: roll and pitch of X are zero,
// with sigma `tilt_sigma` (radians).
PoseEstimate RefinePose(const std::vector<PointObservation>& observations, const Rigid3& T_m_c,
                        double tilt_sigma);

}  // namespace pangea
