#pragma once

// Rigid transforms, rotations and their Jacobians.
//
// Notation: T_a_b takes coordinates in frame b to frame a: p_a = T_a_b * p_b.
// Tangent of a transform: xi = (dp, dtheta), translation first, both expressed in the LEFT frame a:
//   p' = p + dp,   R' = Exp(dtheta) * R.
// Every 6x6 covariance in the project is of this xi (docs/conventions.md).

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace pangea {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

// [v]x, so that Hat(v) * w = v x w.
Eigen::Matrix3d Hat(const Eigen::Vector3d& v);

// SO(3) exponential and logarithm; LogSo3's angle is in [0, pi].
Eigen::Quaterniond ExpSo3(const Eigen::Vector3d& omega);
Eigen::Vector3d LogSo3(const Eigen::Quaterniond& q);

// Right Jacobian: Exp(w + dw) ~ Exp(w) Exp(Jr(w) dw), and its inverse (Forster et al., TRO 2017,
// eq. 8).
Eigen::Matrix3d RightJacobian(const Eigen::Vector3d& omega);
Eigen::Matrix3d RightJacobianInverse(const Eigen::Vector3d& omega);

// Yaw is the rotation about z, the axis of gravity, in radians. YawOf and WrapAngle return angles
// in (-pi, pi].
Eigen::Quaterniond YawRotation(double yaw);
double YawOf(const Eigen::Quaterniond& q_gravity_body);
double WrapAngle(double angle);

struct Rigid3 {
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
  Eigen::Vector3d t = Eigen::Vector3d::Zero();  // metres, in the left frame

  Rigid3() = default;
  Rigid3(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& translation)
      : q(rotation), t(translation) {}

  Eigen::Vector3d operator*(const Eigen::Vector3d& p) const { return q * p + t; }
  Rigid3 operator*(const Rigid3& other) const {
    return {(q * other.q).normalized(), q * other.t + t};
  }
  Rigid3 Inverse() const { return {q.conjugate(), -(q.conjugate() * t)}; }
  Eigen::Matrix3d R() const { return q.toRotationMatrix(); }

  // Plus is this (+) xi, Minus is this (-) other, in the tangent above: a.Plus(b.Minus(a)) == b.
  Rigid3 Plus(const Vector6d& xi) const {
    return {(ExpSo3(xi.tail<3>()) * q).normalized(), t + xi.head<3>()};
  }
  Vector6d Minus(const Rigid3& other) const;
};

// Covariance of T_a_b * T_b_c to first order; the errors of the two factors are independent.
Matrix6d ComposeCovariance(const Rigid3& T_a_b, const Matrix6d& cov_a_b, const Rigid3& T_b_c,
                           const Matrix6d& cov_b_c);

// Covariance of T_b_a from that of T_a_b, to first order.
Matrix6d InverseCovariance(const Rigid3& T_a_b, const Matrix6d& covariance);

// Standard deviation in the direction in which it is largest.
double LargestSigma(const Eigen::Matrix3d& covariance);

}  // namespace pangea
