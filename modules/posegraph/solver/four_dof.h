#pragma once

// Poses and relative poses of four degrees of freedom: x, y, z and yaw (the paper, section IV.D;
// Qin et al., VINS-Mono, TRO 2018, section VIII).
//
// Gravity makes roll and pitch observable, so a keyframe keeps those of its odometry. The remaining
// unknowns are the body's position in the map and the rotation of the odom axes about z:
//   T_map_body = (Rz(yaw) q_odom_body, p).
// Using the rotation of the odom axes instead of the body's own yaw has no singularity at any
// attitude.

#include <Eigen/Core>

#include "core/rigid3.h"

namespace pangea {

using Vector4d = Eigen::Vector4d;
using Matrix4d = Eigen::Matrix4d;

// Largest squared Mahalanobis distance at which a loop is in force, and at which two loops agree:
// the 0.999 quantile of chi-squared with four degrees of freedom.
inline constexpr double kMaxLoopChi2 = 18.47;

// p = Rz(yaw) * (point in the odom axes) + p. For a keyframe, p is p_map_body; for a whole map it
// is the origin of odom, and the pose is T_map_odom.
struct Pose4 {
  Eigen::Vector3d p = Eigen::Vector3d::Zero();  // metres
  double yaw = 0;                               // radians

  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const {
    return YawRotation(yaw) * point + p;
  }
  Pose4 operator*(const Pose4& other) const { return {*this * other.p, yaw + other.yaw}; }
  Pose4 Inverse() const { return {-(YawRotation(-yaw) * p), -yaw}; }
  Rigid3 ToRigid3() const { return {YawRotation(yaw), p}; }
};

// Pose of keyframe `to` relative to `from`: t in from's odom axes, yaw = rotation of to's odom axes
// relative to from's. The covariance is of (t, yaw), with perturbations in from's odom axes.
struct Relative4 {
  Eigen::Vector3d t = Eigen::Vector3d::Zero();
  double yaw = 0;
  Matrix4d covariance = Matrix4d::Identity();

  Relative4 Inverse() const;  // expressed in to's odom axes
};

// Converts a relative pose between bodies, with its 6x6 covariance in from's body frame
// (docs/conventions.md). The covariance is rotated into from's odom axes, where dtheta.z is yaw,
// and its (x, y, z, yaw) block taken: roll and pitch are marginalised, not conditioned. The roll
// and pitch error of from's own attitude also displaces t; its covariance is added.
Relative4 MakeRelative4(const Rigid3& T_from_to, const Matrix6d& covariance,
                        const Eigen::Quaterniond& q_odom_from,
                        const Eigen::Matrix2d& roll_pitch_covariance_from,
                        const Eigen::Quaterniond& q_odom_to);

// predicted - measured for two keyframe poses, in from's odom axes and in the units of the
// measurement, one of which is `scale` metres of the map. The prediction is divided by `scale`, so
// that the residual does not shrink with an unobserved scale.
Vector4d Residual(const Pose4& from, const Pose4& to, const Relative4& measured, double scale = 1);

// Returns L^T, where information = L L^T, so that |L^T r|^2 = r^T information r (L instead of L^T
// is right only for a diagonal matrix). Eigenvalues of the covariance are bounded to 1e-10 .. 1e6,
// the range that a solve can use.
Matrix4d Whitening(const Matrix4d& covariance);

// Covariance of (x, y, z, yaw) at a point rigidly attached to a pose with this covariance; `lever`
// is the vector from the pose to the point.
Matrix4d CovarianceAt(const Matrix4d& covariance, const Eigen::Vector3d& lever);

}  // namespace pangea
