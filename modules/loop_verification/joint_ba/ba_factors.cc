#include "loop_verification/joint_ba/ba_factors.h"

#include <Eigen/Cholesky>
#include <cmath>

namespace pangea {
namespace {

constexpr double kMinDepth = 0.02;  // metres; a step that brings a point nearer is refused

using Jacobian27 = Eigen::Map<Eigen::Matrix<double, 2, 7, Eigen::RowMajor>>;
using Jacobian67 = Eigen::Map<Eigen::Matrix<double, 6, 7, Eigen::RowMajor>>;
using Matrix23 = Eigen::Matrix<double, 2, 3>;

}  // namespace

Rigid3 PoseFromBlock(const double* block) {
  return {Eigen::Map<const Eigen::Quaterniond>(block),
          Eigen::Map<const Eigen::Vector3d>(block + 4)};
}

void PoseToBlock(const Rigid3& pose, double* block) {
  Eigen::Map<Eigen::Quaterniond> q(block);
  Eigen::Map<Eigen::Vector3d> t(block + 4);
  q = pose.q;
  t = pose.t;
}

bool RigidManifold::Plus(const double* x, const double* delta, double* x_plus_delta) const {
  PoseToBlock(PoseFromBlock(x).Plus(Eigen::Map<const Vector6d>(delta)), x_plus_delta);
  return true;
}

bool RigidManifold::PlusJacobian(const double*, double* jacobian) const {
  Eigen::Map<Eigen::Matrix<double, 7, 6, Eigen::RowMajor>>(jacobian).setIdentity();
  return true;
}

bool RigidManifold::Minus(const double* y, const double* x, double* y_minus_x) const {
  Eigen::Map<Vector6d> difference(y_minus_x);
  difference = PoseFromBlock(y).Minus(PoseFromBlock(x));
  return true;
}

bool RigidManifold::MinusJacobian(const double*, double* jacobian) const {
  Eigen::Map<Eigen::Matrix<double, 6, 7, Eigen::RowMajor>>(jacobian).setIdentity();
  return true;
}

bool ReprojectionFactor::Evaluate(double const* const* parameters, double* residuals,
                                  double** jacobians) const {
  const Rigid3 T_host = PoseFromBlock(parameters[0]);
  const Rigid3 T_target = PoseFromBlock(parameters[1]);
  const double x = parameters[2][0], y = parameters[2][1], rho = parameters[2][2];
  if (!(rho > 1e-4)) {
    return false;
  }
  const Eigen::Vector3d p_host_cam = Eigen::Vector3d(x, y, 1.0) / rho;
  const Eigen::Vector3d p_host_body = T_body_cam_host_ * p_host_cam;
  const Eigen::Vector3d p_w = T_host * p_host_body;
  const Eigen::Matrix3d R_target_w = T_target.R().transpose();
  const Eigen::Vector3d p_cam = T_cam_body_target_ * (R_target_w * (p_w - T_target.t));
  if (p_cam.z() < kMinDepth) {
    return false;
  }
  const double inv_z = 1.0 / p_cam.z();
  const Eigen::Vector2d xy = p_cam.head<2>() * inv_z;
  Eigen::Map<Eigen::Vector2d>(residuals, 2) = sqrt_info_ * (xy - ray_);
  if (jacobians == nullptr) {
    return true;
  }
  Matrix23 J_project;
  J_project << inv_z, 0, -xy.x() * inv_z, 0, inv_z, -xy.y() * inv_z;
  const Matrix23 J_w = sqrt_info_ * J_project * T_cam_body_target_.R() * R_target_w;
  if (jacobians[0] != nullptr) {
    Jacobian27 J(jacobians[0]);
    J.leftCols<3>() = J_w;
    J.middleCols<3>(3) = -J_w * Hat(T_host.q * p_host_body);
    J.col(6).setZero();
  }
  if (jacobians[1] != nullptr) {
    Jacobian27 J(jacobians[1]);
    J.leftCols<3>() = -J_w;
    J.middleCols<3>(3) = J_w * Hat(p_w - T_target.t);
    J.col(6).setZero();
  }
  if (jacobians[2] != nullptr) {
    Eigen::Matrix3d J_point = Eigen::Matrix3d::Identity() / rho;
    J_point.col(2) = -p_host_cam / rho;
    Eigen::Map<Eigen::Matrix<double, 2, 3, Eigen::RowMajor>>(jacobians[2], 2, 3) =
        J_w * T_host.R() * T_body_cam_host_.R() * J_point;
  }
  return true;
}

bool PointPriorFactor::Evaluate(double const* const* parameters, double* residuals,
                                double** jacobians) const {
  const Eigen::Map<const Eigen::Vector2d> xy(parameters[0]);
  const double scaled_rho = std::exp(-parameters[1][0]) * rho_;
  Eigen::Map<Eigen::Vector2d>(residuals, 2) = sqrt_info_ * (xy - ray_);
  residuals[2] = (parameters[0][2] - scaled_rho) / sigma_;
  if (jacobians == nullptr) {
    return true;
  }
  if (jacobians[0] != nullptr) {
    Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> J(jacobians[0]);
    J.setZero();
    J.topLeftCorner<2, 2>() = sqrt_info_;
    J(2, 2) = 1.0 / sigma_;
  }
  if (jacobians[1] != nullptr) {
    Eigen::Map<Eigen::Vector3d>(jacobians[1], 3) = Eigen::Vector3d(0, 0, scaled_rho / sigma_);
  }
  return true;
}

EdgeFactor::EdgeFactor(const Rigid3& T_from_to, const Matrix6d& covariance, Metres metres)
    : T_from_to_(T_from_to), metres_(metres) {
  const Eigen::LLT<Matrix6d> llt(covariance);
  sqrt_info_ = llt.matrixL().solve(Matrix6d::Identity());
}

bool EdgeFactor::Evaluate(double const* const* parameters, double* residuals,
                          double** jacobians) const {
  const bool in_world = metres_ == Metres::kWorld;
  const Rigid3 T_from = PoseFromBlock(parameters[0]);
  const Rigid3 T_to = PoseFromBlock(parameters[1]);
  const double kappa = parameters[2][0];
  const double world_scale = in_world ? 1 : std::exp(-kappa);
  const double odometry_scale = in_world ? std::exp(kappa) : 1;
  const Eigen::Matrix3d R_from_w = T_from.R().transpose();
  const Eigen::Vector3d t_world = world_scale * (R_from_w * (T_to.t - T_from.t));
  const Eigen::Vector3d t_odometry = odometry_scale * T_from_to_.t;
  const Eigen::Vector3d r_theta = LogSo3(T_from.q.conjugate() * T_to.q * T_from_to_.q.conjugate());
  Vector6d r;
  r << t_world - t_odometry, r_theta;
  Eigen::Map<Vector6d>(residuals, 6) = sqrt_info_ * r;
  if (jacobians == nullptr) {
    return true;
  }
  // Log(Exp(a) Exp(r)) ~ r + Jl^-1(r) a, and Jl^-1(r) = Jr^-1(-r).
  const Eigen::Matrix3d Jl_inv_R = RightJacobianInverse(-r_theta) * R_from_w;
  Matrix6d J = Matrix6d::Zero();
  J.topLeftCorner<3, 3>() = world_scale * R_from_w;
  J.bottomRightCorner<3, 3>() = Jl_inv_R;
  if (jacobians[1] != nullptr) {
    Jacobian67 J_to(jacobians[1]);
    J_to.leftCols<6>() = sqrt_info_ * J;
    J_to.col(6).setZero();
  }
  if (jacobians[0] != nullptr) {
    J = -J;
    J.topRightCorner<3, 3>() = world_scale * R_from_w * Hat(T_to.t - T_from.t);
    Jacobian67 J_from(jacobians[0]);
    J_from.leftCols<6>() = sqrt_info_ * J;
    J_from.col(6).setZero();
  }
  if (jacobians[2] != nullptr) {
    Eigen::Map<Vector6d>(jacobians[2], 6) =
        -sqrt_info_.leftCols<3>() * (in_world ? t_odometry : t_world);
  }
  return true;
}

bool ScalePriorFactor::Evaluate(double const* const* parameters, double* residuals,
                                double** jacobians) const {
  residuals[0] = parameters[0][0] / sigma_;
  if (jacobians != nullptr && jacobians[0] != nullptr) {
    jacobians[0][0] = 1.0 / sigma_;
  }
  return true;
}

}  // namespace pangea
