#include "core/least_squares/edge_residual.h"

#include <Eigen/Cholesky>
#include <cmath>

namespace pangea {

EdgeResidual::EdgeResidual(const Rigid3& T_from_to, const Matrix6d& covariance, Scale scale)
    : T_from_to_(T_from_to), scale_(scale) {
  const Eigen::LLT<Matrix6d> llt(covariance);
  sqrt_info_ = llt.matrixL().solve(Matrix6d::Identity());
}

Vector6d EdgeResidual::Evaluate(const Rigid3& T_map_from, const Rigid3& T_map_to, double kappa,
                                Jacobians* jacobians) const {
  const bool in_map = scale_ == Scale::kMap;
  const double map_scale = in_map ? 1 : std::exp(-kappa);
  const double odometry_scale = in_map ? std::exp(kappa) : 1;
  const Eigen::Matrix3d R_from_map = T_map_from.R().transpose();
  const Eigen::Vector3d step_map = T_map_to.t - T_map_from.t;
  const Eigen::Vector3d t_map = map_scale * (R_from_map * step_map);
  const Eigen::Vector3d t_odometry = odometry_scale * T_from_to_.t;
  const Eigen::Vector3d r_theta =
      LogSo3(T_map_from.q.conjugate() * T_map_to.q * T_from_to_.q.conjugate());
  Vector6d r;
  r << t_map - t_odometry, r_theta;
  if (jacobians != nullptr) {
    Matrix6d J = Matrix6d::Zero();
    J.topLeftCorner<3, 3>() = map_scale * R_from_map;
    // Log(Exp(a) Exp(r)) ~ r + Jl^-1(r) a, and Jl^-1(r) = Jr^-1(-r).
    J.bottomRightCorner<3, 3>() = RightJacobianInverse(-r_theta) * R_from_map;
    jacobians->to = sqrt_info_ * J;
    J = -J;
    J.topRightCorner<3, 3>() = map_scale * R_from_map * Hat(step_map);
    jacobians->from = sqrt_info_ * J;
    jacobians->scale = -sqrt_info_.leftCols<3>() * (in_map ? t_odometry : t_map);
  }
  return sqrt_info_ * r;
}

}  // namespace pangea
