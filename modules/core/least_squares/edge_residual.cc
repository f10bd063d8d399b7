#include "core/least_squares/edge_residual.h"

#include <Eigen/Cholesky>
#include <cmath>

namespace pangea {

EdgeResidual::EdgeResidual(const Rigid3& T_from_to, const Matrix6d& covariance, Metres metres)
    : T_from_to_(T_from_to), metres_(metres) {
  const Eigen::LLT<Matrix6d> llt(covariance);
  sqrt_info_ = llt.matrixL().solve(Matrix6d::Identity());
}

Vector6d EdgeResidual::Evaluate(const Rigid3& T_w_from, const Rigid3& T_w_to, double kappa,
                                Jacobians* jacobians) const {
  const bool in_world = metres_ == Metres::kWorld;
  const double world_scale = in_world ? 1 : std::exp(-kappa);
  const double odometry_scale = in_world ? std::exp(kappa) : 1;
  const Eigen::Matrix3d R_from_w = T_w_from.R().transpose();
  const Eigen::Vector3d step_w = T_w_to.t - T_w_from.t;
  const Eigen::Vector3d t_world = world_scale * (R_from_w * step_w);
  const Eigen::Vector3d t_odometry = odometry_scale * T_from_to_.t;
  const Eigen::Vector3d r_theta =
      LogSo3(T_w_from.q.conjugate() * T_w_to.q * T_from_to_.q.conjugate());
  Vector6d r;
  r << t_world - t_odometry, r_theta;
  if (jacobians != nullptr) {
    Matrix6d J = Matrix6d::Zero();
    J.topLeftCorner<3, 3>() = world_scale * R_from_w;
    // Log(Exp(a) Exp(r)) ~ r + Jl^-1(r) a, and Jl^-1(r) = Jr^-1(-r).
    J.bottomRightCorner<3, 3>() = RightJacobianInverse(-r_theta) * R_from_w;
    jacobians->to = sqrt_info_ * J;
    J = -J;
    J.topRightCorner<3, 3>() = world_scale * R_from_w * Hat(step_w);
    jacobians->from = sqrt_info_ * J;
    jacobians->scale = -sqrt_info_.leftCols<3>() * (in_world ? t_odometry : t_world);
  }
  return sqrt_info_ * r;
}

}  // namespace pangea
