#pragma once

// The residual of window_localization.h: where a landmark of the map should be seen.
//
//   p = c + Rz(yaw) (p_map - c) + shift,   y = T_cam_body T_body_map p,   r = y.xy / y.z - ray
//
// c is the camera of the landmark's source. Its own error is integrated out: the rays' residuals
// have covariance diag(sigma^2) + J_p Cov(p) J_p^T and come whitened by its Cholesky factor.

#include <Eigen/Core>
#include <vector>

#include "core/rigid3.h"
#include "vio/live/window_localization.h"

namespace pangea::vio {

struct Whitened {
  Eigen::VectorXd r;  // empty when a camera would not see it
  // By the error (dtheta, xi) of each ray's pose, in the rays' order, and of the source.
  Eigen::MatrixXd J_pose;
  Eigen::Matrix<double, Eigen::Dynamic, 4> J_source;
};

// Poses and `p_source` are in the map shifted by `origin`; `source`: (shift, yaw).
Whitened WhitenLandmark(const std::vector<Rigid3>& poses, const Rigid3& T_body_cam,
                        const SeenLandmark& landmark, const Eigen::Vector3d& origin,
                        const Eigen::Vector3d& p_source, const Eigen::Vector4d& source);

}  // namespace pangea::vio
