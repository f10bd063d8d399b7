#include "posegraph/solver/pose_cost.h"

#include <cmath>

namespace pangea {
namespace {

// `jacobians` as Ceres passes it: null, or per parameter block a matrix or null.
void EvaluateEdge(const WeightedEdge& edge, double const* const* parameters, double scale,
                  double* residuals, double** jacobians) {
  using JacobianMap = Eigen::Map<Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>;
  const Pose4 from{Eigen::Vector3d::Map(parameters[0]), parameters[0][3]};
  const Pose4 to{Eigen::Vector3d::Map(parameters[1]), parameters[1][3]};
  const Matrix4d W = *edge.sqrt_weight * edge.whitening;
  Vector4d::Map(residuals) = W * Residual(from, to, edge.measured, scale);
  if (jacobians == nullptr) {
    return;
  }
  const Eigen::Matrix3d R_odom_map = YawRotation(-from.yaw).toRotationMatrix();
  Matrix4d J = Matrix4d::Identity();
  J.topLeftCorner<3, 3>() = R_odom_map / scale;
  if (jacobians[1] != nullptr) {
    JacobianMap{jacobians[1]} = W * J;
  }
  if (jacobians[0] != nullptr) {
    const Eigen::Vector3d d = R_odom_map * (to.p - from.p) / scale;
    J = -J;
    J(0, 3) = d.y();
    J(1, 3) = -d.x();
    JacobianMap{jacobians[0]} = W * J;
  }
}

}  // namespace

bool RelativePoseCost::Evaluate(double const* const* parameters, double* residuals,
                                double** jacobians) const {
  EvaluateEdge(edge_, parameters, 1, residuals, jacobians);
  return true;
}

bool ScaledPoseCost::Evaluate(double const* const* parameters, double* residuals,
                              double** jacobians) const {
  const double scale = std::exp(parameters[2][0]);
  EvaluateEdge(edge_, parameters, scale, residuals, jacobians);
  if (jacobians != nullptr && jacobians[2] != nullptr) {
    const Eigen::Vector3d step_map =
        Eigen::Vector3d::Map(parameters[1]) - Eigen::Vector3d::Map(parameters[0]);
    const Eigen::Vector3d d = YawRotation(-parameters[0][3]) * step_map / scale;
    Vector4d::Map(jacobians[2]) = -*edge_.sqrt_weight * (edge_.whitening.leftCols<3>() * d);
  }
  return true;
}

}  // namespace pangea
