#include "posegraph/solver/pose_cost.h"

#include <cmath>

namespace pangea {

bool RelativePoseCost::Evaluate(double const* const* parameters, double* residuals,
                                double** jacobians) const {
  using JacobianMap = Eigen::Map<Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>;
  const Pose4 from{Eigen::Vector3d::Map(parameters[0]), parameters[0][3]};
  const Pose4 to{Eigen::Vector3d::Map(parameters[1]), parameters[1][3]};
  const Matrix4d W = *sqrt_weight_ * whitening_;
  Vector4d::Map(residuals) = W * Residual(from, to, measured_);
  if (jacobians == nullptr) {
    return true;
  }
  const Eigen::Matrix3d R_odom_map = YawRotation(-from.yaw).toRotationMatrix();
  Matrix4d J = Matrix4d::Identity();
  J.topLeftCorner<3, 3>() = R_odom_map;
  if (jacobians[1] != nullptr) {
    JacobianMap{jacobians[1]} = W * J;
  }
  if (jacobians[0] != nullptr) {
    const Eigen::Vector3d d = R_odom_map * (to.p - from.p);
    J = -J;
    J(0, 3) = d.y();
    J(1, 3) = -d.x();
    JacobianMap{jacobians[0]} = W * J;
  }
  return true;
}

bool ScaledPoseCost::Evaluate(double const* const* parameters, double* residuals,
                              double** jacobians) const {
  using JacobianMap = Eigen::Map<Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>;
  const Pose4 from{Eigen::Vector3d::Map(parameters[0]), parameters[0][3]};
  const Pose4 to{Eigen::Vector3d::Map(parameters[1]), parameters[1][3]};
  const double scale = std::exp(parameters[2][0]);
  const Matrix4d W = *sqrt_weight_ * whitening_;
  Vector4d::Map(residuals) = W * Residual(from, to, measured_, scale);
  if (jacobians == nullptr) {
    return true;
  }
  const Eigen::Matrix3d R = YawRotation(-from.yaw).toRotationMatrix() / scale;
  const Eigen::Vector3d d = R * (to.p - from.p);
  Matrix4d J = Matrix4d::Identity();
  J.topLeftCorner<3, 3>() = R;
  if (jacobians[1] != nullptr) {
    JacobianMap{jacobians[1]} = W * J;
  }
  if (jacobians[0] != nullptr) {
    J = -J;
    J(0, 3) = d.y();
    J(1, 3) = -d.x();
    JacobianMap{jacobians[0]} = W * J;
  }
  if (jacobians[2] != nullptr) {
    Vector4d::Map(jacobians[2]) = -W.leftCols<3>() * d;
  }
  return true;
}

bool ScalePriorCost::Evaluate(double const* const* parameters, double* residuals,
                              double** jacobians) const {
  residuals[0] = parameters[0][0] / sigma_;
  if (jacobians != nullptr && jacobians[0] != nullptr) {
    jacobians[0][0] = 1 / sigma_;
  }
  return true;
}

}  // namespace pangea
