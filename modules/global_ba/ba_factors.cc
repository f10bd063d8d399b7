#include "global_ba/ba_factors.h"

#include <Eigen/Cholesky>
#include <cmath>

namespace pangea {
namespace {

template <int kRows, int kColumns>
using RowMajor = Eigen::Matrix<double, kRows, kColumns, Eigen::RowMajor>;

template <int kRows, int kColumns>
Eigen::Map<RowMajor<kRows, kColumns>> AsMatrix(double* jacobian) {
  return Eigen::Map<RowMajor<kRows, kColumns>>(jacobian);
}

// The residual is the same in any frame whose z axis points up.
ImuState InOdom(const KeyframeState& state) {
  return {state.T_map_body, state.v_map_body, state.gyro_bias, state.accel_bias};
}

// Converts J from the errors of the inertial residual (right-invariant) to those of the blocks: a
// rotation error also rotates position and velocity, e_p = dp + p x dtheta.
RowMajor<15, 7> PoseJacobian(const Eigen::Matrix<double, 15, 15>& J, const ImuState& state) {
  RowMajor<15, 7> J_pose;
  J_pose.leftCols<3>() = J.middleCols<3>(kPosition);
  J_pose.middleCols<3>(3) = J.middleCols<3>(kTheta) +
                            J.middleCols<3>(kPosition) * Hat(state.T_odom_body.t) +
                            J.middleCols<3>(kVelocity) * Hat(state.v_odom_body);
  J_pose.col(6).setZero();
  return J_pose;
}

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

KeyframeState StateFromBlocks(const double* pose, const double* motion) {
  return {PoseFromBlock(pose), Eigen::Vector3d::Map(motion), Eigen::Vector3d::Map(motion + 3),
          Eigen::Vector3d::Map(motion + 6)};
}

PreintegrationFactor::PreintegrationFactor(const Preintegration& measured, const ImuNoise& noise)
    : measured_(measured), sqrt_info_(InertialInformation(measured, noise).llt().matrixU()) {}

bool PreintegrationFactor::Evaluate(double const* const* parameters, double* residuals,
                                    double** jacobians) const {
  const ImuState from = InOdom(StateFromBlocks(parameters[0], parameters[1]));
  const ImuState to = InOdom(StateFromBlocks(parameters[2], parameters[3]));
  const InertialResidual residual = ComputeInertialResidual(measured_, from, to);
  Eigen::Map<Eigen::Matrix<double, 15, 1>> r(residuals);
  r = sqrt_info_ * residual.r;
  if (jacobians == nullptr) {
    return true;
  }
  if (jacobians[0] != nullptr) {
    AsMatrix<15, 7>(jacobians[0]) = sqrt_info_ * PoseJacobian(residual.J_from, from);
  }
  if (jacobians[1] != nullptr) {
    AsMatrix<15, 9>(jacobians[1]) = sqrt_info_ * residual.J_from.rightCols<9>();
  }
  if (jacobians[2] != nullptr) {
    AsMatrix<15, 7>(jacobians[2]) = sqrt_info_ * PoseJacobian(residual.J_to, to);
  }
  if (jacobians[3] != nullptr) {
    AsMatrix<15, 9>(jacobians[3]) = sqrt_info_ * residual.J_to.rightCols<9>();
  }
  return true;
}

BiasPriorFactor::BiasPriorFactor(double gyro_sigma, double accel_sigma) {
  inverse_sigma_ << Eigen::Vector3d::Constant(1 / gyro_sigma),
      Eigen::Vector3d::Constant(1 / accel_sigma);
}

bool BiasPriorFactor::Evaluate(double const* const* parameters, double* residuals,
                               double** jacobians) const {
  const Eigen::Map<const Eigen::Matrix<double, 6, 1>> bias(parameters[0] + 3);
  Eigen::Map<Eigen::Matrix<double, 6, 1>> r(residuals);
  r = inverse_sigma_.cwiseProduct(bias);
  if (jacobians != nullptr && jacobians[0] != nullptr) {
    Eigen::Map<RowMajor<6, 9>> J = AsMatrix<6, 9>(jacobians[0]);
    J.setZero();
    J.rightCols<6>() = inverse_sigma_.asDiagonal();
  }
  return true;
}

CameraPriorFactor::CameraPriorFactor(const Rigid3& T_body_cam, double position_sigma,
                                     double rotation_sigma)
    : prior_(T_body_cam) {
  inverse_sigma_ << Eigen::Vector3d::Constant(1 / position_sigma),
      Eigen::Vector3d::Constant(1 / rotation_sigma);
}

bool CameraPriorFactor::Evaluate(double const* const* parameters, double* residuals,
                                 double** jacobians) const {
  const Vector6d error = PoseFromBlock(parameters[0]).Minus(prior_);
  Eigen::Map<Vector6d> r(residuals);
  r = inverse_sigma_.cwiseProduct(error);
  if (jacobians != nullptr && jacobians[0] != nullptr) {
    // Log(Exp(d) Exp(e)) ~ e + Jl^-1(e) d, and Jl^-1(e) = Jr^-1(-e).
    Matrix6d J = Matrix6d::Identity();
    J.bottomRightCorner<3, 3>() = RightJacobianInverse(-error.tail<3>());
    AsMatrix<6, 7>(jacobians[0]) << inverse_sigma_.asDiagonal() * J, Vector6d::Zero();
  }
  return true;
}

bool EdgeFactor::Evaluate(double const* const* parameters, double* residuals,
                          double** jacobians) const {
  EdgeResidual::Jacobians J;
  Eigen::Map<Vector6d> r(residuals);
  r = residual_.Evaluate(PoseFromBlock(parameters[0]), PoseFromBlock(parameters[1]),
                         parameters[2][0], jacobians == nullptr ? nullptr : &J);
  if (jacobians == nullptr) {
    return true;
  }
  if (jacobians[0] != nullptr) {
    AsMatrix<6, 7>(jacobians[0]) << J.from, Vector6d::Zero();
  }
  if (jacobians[1] != nullptr) {
    AsMatrix<6, 7>(jacobians[1]) << J.to, Vector6d::Zero();
  }
  if (jacobians[2] != nullptr) {
    Eigen::Map<Vector6d>(jacobians[2], 6) = J.scale;
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
