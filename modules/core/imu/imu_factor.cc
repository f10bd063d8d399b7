#include "core/imu/imu_factor.h"

#include <Eigen/Cholesky>
#include <cmath>

namespace pangea {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using Matrix15d = Eigen::Matrix<double, 15, 15>;

// Rows of the residual.
constexpr int kRowTheta = 0, kRowVelocity = 3, kRowPosition = 6, kRowBias = 9;
const Vector3d kGravityVector(0, 0, -kGravity);

// Integration itself is not exact, so the standard deviations are at least these: rad, m/s, m.
constexpr double kFloorTheta = 1e-5, kFloorVelocity = 1e-4, kFloorPosition = 1e-5;

}  // namespace

InertialResidual ComputeInertialResidual(const Preintegration& measured, const ImuState& from,
                                         const ImuState& to) {
  const double dt = measured.duration_s;
  const CorrectedDelta delta = CorrectForBias(measured, from.gyro_bias, from.accel_bias);
  const Matrix3d R_from_odom = from.T_odom_body.R().transpose();
  const Vector3d fall_v = dt * kGravityVector;
  const Vector3d fall_p = 0.5 * dt * dt * kGravityVector;
  const Vector3d& p_i = from.T_odom_body.t;
  const Vector3d& p_j = to.T_odom_body.t;
  const Vector3d& v_i = from.v_odom_body;
  const Vector3d& v_j = to.v_odom_body;
  const Quaterniond q_error =
      delta.q.conjugate() * from.T_odom_body.q.conjugate() * to.T_odom_body.q;

  InertialResidual out;
  out.r.segment<3>(kRowTheta) = LogSo3(q_error);
  out.r.segment<3>(kRowVelocity) = R_from_odom * (v_j - v_i - fall_v) - delta.v;
  out.r.segment<3>(kRowPosition) = R_from_odom * (p_j - p_i - dt * v_i - fall_p) - delta.p;
  out.r.segment<3>(kRowBias) = to.gyro_bias - from.gyro_bias;
  out.r.segment<3>(kRowBias + 3) = to.accel_bias - from.accel_bias;

  out.J_from.setZero();
  out.J_to.setZero();
  const Matrix3d Jr_inverse = RightJacobianInverse(out.r.segment<3>(kRowTheta));
  const Matrix3d rotation = Jr_inverse * to.T_odom_body.R().transpose();
  out.J_from.block<3, 3>(kRowTheta, kTheta) = -rotation;
  out.J_to.block<3, 3>(kRowTheta, kTheta) = rotation;

  out.J_from.block<3, 3>(kRowVelocity, kTheta) = R_from_odom * Hat(v_j - fall_v);
  out.J_to.block<3, 3>(kRowVelocity, kTheta) = -R_from_odom * Hat(v_j);
  out.J_from.block<3, 3>(kRowVelocity, kVelocity) = -R_from_odom;
  out.J_to.block<3, 3>(kRowVelocity, kVelocity) = R_from_odom;

  out.J_from.block<3, 3>(kRowPosition, kTheta) = R_from_odom * Hat(p_j - fall_p);
  out.J_to.block<3, 3>(kRowPosition, kTheta) = -R_from_odom * Hat(p_j);
  out.J_from.block<3, 3>(kRowPosition, kPosition) = -R_from_odom;
  out.J_to.block<3, 3>(kRowPosition, kPosition) = R_from_odom;
  out.J_from.block<3, 3>(kRowPosition, kVelocity) = -dt * R_from_odom;

  // The measured motion depends on the biases of the first frame.
  const Vector3d rotated_by_bias =
      measured.bias_jacobian.topLeftCorner<3, 3>() * (from.gyro_bias - measured.gyro_bias);
  out.J_from.block<3, 3>(kRowTheta, kGyroBias) =
      -Jr_inverse * q_error.toRotationMatrix().transpose() * RightJacobian(rotated_by_bias) *
      measured.bias_jacobian.topLeftCorner<3, 3>();
  out.J_from.block<6, 6>(kRowVelocity, kGyroBias) = -measured.bias_jacobian.bottomRows<6>();

  out.J_from.block<6, 6>(kRowBias, kGyroBias) = -Eigen::Matrix<double, 6, 6>::Identity();
  out.J_to.block<6, 6>(kRowBias, kGyroBias).setIdentity();
  return out;
}

Matrix15d InertialInformation(const Preintegration& measured, const ImuNoise& noise,
                              double unmodelled_accel_sigma) {
  Eigen::Matrix<double, 9, 9> covariance = measured.covariance;
  Eigen::Matrix<double, 9, 1> floor;
  floor << Vector3d::Constant(kFloorTheta), Vector3d::Constant(kFloorVelocity),
      Vector3d::Constant(kFloorPosition);
  covariance.diagonal() += floor.cwiseAbs2();
  // The biases also change between the two frames, which matters when that time is long (a
  // stationary body).
  const double dt = measured.duration_s;
  const double gyro_walk = noise.gyro_random_walk * noise.gyro_random_walk * dt;
  const double accel_walk = noise.accel_random_walk * noise.accel_random_walk * dt;
  covariance.diagonal().segment<3>(kRowTheta).array() += gyro_walk * dt * dt / 3;
  covariance.diagonal().segment<3>(kRowVelocity).array() += accel_walk * dt * dt / 3;
  covariance.diagonal().segment<3>(kRowPosition).array() += accel_walk * (dt * dt * dt * dt) / 20;
  Eigen::Matrix<double, 9, 3> of_accel = Eigen::Matrix<double, 9, 3>::Zero();
  of_accel.middleRows<3>(kRowVelocity).diagonal().setConstant(unmodelled_accel_sigma * dt);
  of_accel.middleRows<3>(kRowPosition)
      .diagonal()
      .setConstant(0.5 * unmodelled_accel_sigma * dt * dt);
  covariance += of_accel * of_accel.transpose();
  Matrix15d information = Matrix15d::Zero();
  information.topLeftCorner<9, 9>() =
      covariance.llt().solve(Eigen::Matrix<double, 9, 9>::Identity());
  information.diagonal().segment<3>(kRowBias).setConstant(1 / gyro_walk);
  information.diagonal().segment<3>(kRowBias + 3).setConstant(1 / accel_walk);
  return information;
}

ImuState Predict(const Preintegration& measured, const ImuState& from) {
  const double dt = measured.duration_s;
  const CorrectedDelta delta = CorrectForBias(measured, from.gyro_bias, from.accel_bias);
  const Quaterniond& q = from.T_odom_body.q;
  ImuState to = from;
  to.v_odom_body = from.v_odom_body + dt * kGravityVector + q * delta.v;
  to.T_odom_body.t =
      from.T_odom_body.t + dt * from.v_odom_body + 0.5 * dt * dt * kGravityVector + q * delta.p;
  to.T_odom_body.q = (q * delta.q).normalized();
  return to;
}

}  // namespace pangea
