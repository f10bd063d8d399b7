#include "posegraph/solver/pose_cost.h"

#include <cmath>

namespace pangea {

Vector4d PoseCost::Residual(const Pose4& from, const Pose4& to, double log_scale) const {
  return whitening_ * pangea::Residual(from, to, measured_, std::exp(log_scale));
}

Vector4d PoseCost::Linearise(const Pose4& from, const Pose4& to, double log_scale,
                             Jacobians* J) const {
  const double scale = std::exp(log_scale);
  const Eigen::Matrix3d R_odom_map = YawRotation(-from.yaw).toRotationMatrix();
  const Eigen::Vector3d d = R_odom_map * (to.p - from.p) / scale;
  Matrix4d to_from = Matrix4d::Identity();
  to_from.topLeftCorner<3, 3>() = R_odom_map / scale;
  J->to = whitening_ * to_from;
  to_from = -to_from;
  to_from(0, 3) = d.y();
  to_from(1, 3) = -d.x();
  J->from = whitening_ * to_from;
  J->log_scale = -(whitening_.leftCols<3>() * d);
  return Residual(from, to, log_scale);
}

}  // namespace pangea
