#pragma once

// The reprojection residual of a map landmark, for window_localisation.h.
//
//   p = c + Rz(yaw) (p_map - c) + shift,   y = T_cam_body T_body_map p,   r = y.xy / y.z - ray
//
// c is the camera position of the landmark's source keyframe. The landmark's own error is
// marginalised: the rays' residuals have covariance diag(sigma^2) + J_p Cov(p) J_p^T, and are
// whitened by its Cholesky factor.

#include <Eigen/Core>
#include <vector>

#include "core/rigid3.h"
#include "vio/live/window_localisation.h"

namespace pangea::vio {

struct Whitened {
  Eigen::VectorXd r;  // empty if the point is behind one of the cameras
  // With respect to the errors (dtheta, xi) of each ray's pose, in the order of the rays, and to
  // `source`.
  Eigen::MatrixXd J_pose;
  Eigen::Matrix<double, Eigen::Dynamic, 4> J_source;
};

// Poses and `p_source` are relative to `origin`, in map axes. `source`: (shift, yaw), the error of
// the source keyframe.
Whitened WhitenLandmark(const std::vector<Rigid3>& poses, const Rigid3& T_body_cam,
                        const SeenLandmark& landmark, const Eigen::Vector3d& origin,
                        const Eigen::Vector3d& p_source, const Eigen::Vector4d& source);

}  // namespace pangea::vio
