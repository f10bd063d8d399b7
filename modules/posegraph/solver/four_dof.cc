#include "posegraph/solver/four_dof.h"

#include <Eigen/Cholesky>
#include <cmath>

namespace pangea {
namespace {

// z x v.
Eigen::Vector3d RotatedByZ(const Eigen::Vector3d& v) { return {-v.y(), v.x(), 0}; }

Matrix4d BlockRotation(double yaw) {
  Matrix4d R = Matrix4d::Identity();
  R.topLeftCorner<3, 3>() = YawRotation(yaw).toRotationMatrix();
  return R;
}

}  // namespace

Relative4 Relative4::Inverse() const {
  // t' = -Rz(-yaw) t, so dt' = -Rz(-yaw) dt - (z x t') dyaw, and dyaw' = -dyaw.
  Relative4 inverse;
  inverse.t = -(YawRotation(-yaw) * t);
  inverse.yaw = -yaw;
  Matrix4d J = -BlockRotation(-yaw);
  J.topRightCorner<3, 1>() = -RotatedByZ(inverse.t);
  inverse.covariance = J * covariance * J.transpose();
  return inverse;
}

Relative4 MakeRelative4(const Rigid3& T_from_to, const Matrix6d& covariance,
                        const Eigen::Quaterniond& q_odom_from,
                        const Eigen::Matrix2d& roll_pitch_covariance_from,
                        const Eigen::Quaterniond& q_odom_to) {
  Relative4 relative;
  relative.t = q_odom_from * T_from_to.t;
  // The rotation about z that is nearest to the rotation between the two odom axes (swing and
  // twist).
  const Eigen::Quaterniond rotation = q_odom_from * T_from_to.q * q_odom_to.conjugate();
  relative.yaw = WrapAngle(2 * std::atan2(rotation.z(), rotation.w()));

  Matrix6d R = Matrix6d::Zero();
  R.topLeftCorner<3, 3>() = R.bottomRightCorner<3, 3>() = q_odom_from.toRotationMatrix();
  const Matrix6d in_odom_axes = R * covariance * R.transpose();
  constexpr int kBlock[4] = {0, 1, 2, 5};
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 4; ++column) {
      relative.covariance(row, column) = in_odom_axes(kBlock[row], kBlock[column]);
    }
  }
  const Eigen::Matrix<double, 3, 2> tilt = -Hat(relative.t).leftCols<2>();
  relative.covariance.topLeftCorner<3, 3>() += tilt * roll_pitch_covariance_from * tilt.transpose();
  return relative;
}

Vector4d Residual(const Pose4& from, const Pose4& to, const Relative4& measured, double scale) {
  Vector4d residual;
  residual << YawRotation(-from.yaw) * (to.p - from.p) / scale - measured.t,
      WrapAngle(to.yaw - from.yaw - measured.yaw);
  return residual;
}

Matrix4d Whitening(const Matrix4d& covariance) {
  constexpr double kMinVariance = 1e-10, kMinInformation = 1e-6;
  const Matrix4d bounded = covariance + kMinVariance * Matrix4d::Identity();
  Matrix4d information = bounded.ldlt().solve(Matrix4d::Identity());
  information = 0.5 * (information + information.transpose()).eval();
  information += kMinInformation * Matrix4d::Identity();
  return information.llt().matrixU();
}

Matrix4d CovarianceAt(const Matrix4d& covariance, const Eigen::Vector3d& lever) {
  Matrix4d J = Matrix4d::Identity();
  J.topRightCorner<3, 1>() = RotatedByZ(lever);
  return J * covariance * J.transpose();
}

}  // namespace pangea
