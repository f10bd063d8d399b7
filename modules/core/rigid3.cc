#include "core/rigid3.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/numerics/elementary.h"

namespace pangea {

Eigen::Matrix3d Hat(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

Eigen::Quaterniond ExpSo3(const Eigen::Vector3d& omega) {
  const double angle2 = omega.squaredNorm();
  // sin(x/2)/x by its series below 1e-4 rad, where the quotient loses digits.
  const double angle = std::sqrt(angle2);
  const SinCos half = SinCosOf(0.5 * angle);
  const double imag = angle2 < 1e-8 ? 0.5 - angle2 / 48.0 : half.sin / angle;
  const double real = angle2 < 1e-8 ? 1.0 - angle2 / 8.0 : half.cos;
  return Eigen::Quaterniond(real, imag * omega.x(), imag * omega.y(), imag * omega.z())
      .normalized();
}

Eigen::Vector3d LogSo3(const Eigen::Quaterniond& q) {
  const double sign = q.w() < 0 ? -1.0 : 1.0;  // q and -q are one rotation
  const Eigen::Vector3d v = sign * q.vec();
  const double n = v.norm();
  if (n < 1e-10) {
    return 2.0 * v;
  }
  return 2.0 * Atan2(n, sign * q.w()) / n * v;
}

Eigen::Matrix3d RightJacobian(const Eigen::Vector3d& omega) {
  const double a2 = omega.squaredNorm();
  const Eigen::Matrix3d W = Hat(omega);
  if (a2 < 1e-8) {
    return Eigen::Matrix3d::Identity() - 0.5 * W + W * W / 6.0;
  }
  const double a = std::sqrt(a2);
  const SinCos of = SinCosOf(a);
  return Eigen::Matrix3d::Identity() - (1 - of.cos) / a2 * W + (a - of.sin) / (a2 * a) * W * W;
}

Eigen::Matrix3d RightJacobianInverse(const Eigen::Vector3d& omega) {
  const double a2 = omega.squaredNorm();
  const Eigen::Matrix3d W = Hat(omega);
  if (a2 < 1e-8) {
    return Eigen::Matrix3d::Identity() + 0.5 * W + W * W / 12.0;
  }
  const double a = std::sqrt(a2);
  const SinCos of = SinCosOf(a);
  return Eigen::Matrix3d::Identity() + 0.5 * W +
         (1.0 / a2 - (1 + of.cos) / (2 * a * of.sin)) * W * W;
}

Eigen::Quaterniond YawRotation(double yaw) {
  const SinCos half = SinCosOf(0.5 * yaw);
  return {half.cos, 0.0, 0.0, half.sin};
}

double YawOf(const Eigen::Quaterniond& q) {
  return Atan2(2 * (q.w() * q.z() + q.x() * q.y()), 1 - 2 * (q.y() * q.y() + q.z() * q.z()));
}

double WrapAngle(double angle) {
  constexpr double kTwoPi = 2 * std::numbers::pi;
  const double wrapped = std::remainder(angle, kTwoPi);
  return wrapped <= -std::numbers::pi ? std::numbers::pi : wrapped;
}

Vector6d Rigid3::Minus(const Rigid3& other) const {
  Vector6d xi;
  xi << t - other.t, LogSo3(q * other.q.conjugate());
  return xi;
}

Matrix6d ComposeCovariance(const Rigid3& T_a_b, const Matrix6d& cov_a_b, const Rigid3& T_b_c,
                           const Matrix6d& cov_b_c) {
  // t_ac = R_ab t_bc + t_ab: the left factor's rotation error rotates the lever R_ab t_bc.
  Matrix6d J_left = Matrix6d::Identity();
  J_left.topRightCorner<3, 3>() = -Hat(T_a_b.q * T_b_c.t);
  Matrix6d J_right = Matrix6d::Zero();
  J_right.topLeftCorner<3, 3>() = T_a_b.R();
  J_right.bottomRightCorner<3, 3>() = T_a_b.R();
  return J_left * cov_a_b * J_left.transpose() + J_right * cov_b_c * J_right.transpose();
}

Matrix6d InverseCovariance(const Rigid3& T_a_b, const Matrix6d& covariance) {
  const Eigen::Matrix3d R_b_a = T_a_b.R().transpose();
  Matrix6d J = Matrix6d::Zero();
  J.topLeftCorner<3, 3>() = -R_b_a;
  J.topRightCorner<3, 3>() = -R_b_a * Hat(T_a_b.t);
  J.bottomRightCorner<3, 3>() = -R_b_a;
  return J * covariance * J.transpose();
}

double LargestSigma(const Eigen::Matrix3d& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance, Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(0.0, solver.eigenvalues().maxCoeff()));
}

}  // namespace pangea
