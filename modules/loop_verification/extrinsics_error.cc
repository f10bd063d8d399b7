#include "loop_verification/extrinsics_error.h"

namespace pangea {

Matrix6d ExtrinsicsCovariance(const Keyframe& m, const Keyframe& c, const Rigid3& T_m_c) {
  const Eigen::Matrix3d R = T_m_c.R();
  Matrix6d J_m = Matrix6d::Identity();
  J_m.topRightCorner<3, 3>() = -Hat(T_m_c.t - m.camera.T_body_cam.t);
  Matrix6d J_c = Matrix6d::Zero();
  J_c.topLeftCorner<3, 3>() = J_c.bottomRightCorner<3, 3>() = -R;
  J_c.topRightCorner<3, 3>() = -R * Hat(c.camera.T_body_cam.t);
  if (m.id.map.agent_id == c.id.map.agent_id) {
    const Matrix6d J = J_m + J_c;
    return J * m.T_body_cam_covariance * J.transpose();
  }
  return J_m * m.T_body_cam_covariance * J_m.transpose() +
         J_c * c.T_body_cam_covariance * J_c.transpose();
}

}  // namespace pangea
