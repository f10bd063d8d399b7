#pragma once

// A smooth path of the body: uniform quintic B-splines, one on the position and one on the
// unnormalised quaternion, fitted to timed poses by linear least squares. Velocity, acceleration
// and angular velocity are exact derivatives of the pose in At(), so an IMU made from them
// integrates back to the path. Frames: `ref` is the trajectory's own, gravity-aligned (z up).
//
// Source: de Boor, A Practical Guide to Splines, ch. IX (uniform knots); the quaternion's rate as
// in Sola, Quaternion kinematics for the error-state Kalman filter, 2017, eq. 197.

#include <Eigen/Core>
#include <cstdint>

#include "recording/trajectory.h"

namespace pangea::sim {

// A curve in R^n with control points one knot spacing apart.
class UniformSpline {
 public:
  static constexpr int kDegree = 5;

  // Least-squares fit to `values` (one row per time) at `times_s`, ascending from 0. A weak penalty
  // on third differences bridges gaps.
  UniformSpline(const Eigen::VectorXd& times_s, const Eigen::MatrixXd& values, double spacing_s);

  // Value (order 0) or derivative (order 1, 2) at a time inside the fitted span.
  Eigen::VectorXd At(double time_s, int order) const;
  const Eigen::MatrixXd& control_points() const { return control_points_; }

 private:
  double spacing_s_;
  Eigen::MatrixXd control_points_;
};

struct PathState {
  Rigid3 T_ref_body;
  Eigen::Vector3d v_ref_body;  // m/s
  Eigen::Vector3d a_ref_body;  // m/s^2, without gravity
  Eigen::Vector3d omega_body;  // rad/s, in the body frame
};

struct SplinePathOptions {
  // Frequencies above about 1 / (2 * spacing) are smoothed away.
  double position_spacing_s = 0.1;
  double rotation_spacing_s = 0.05;
};

class SplinePath {
 public:
  // At least two poses.
  SplinePath(const Trajectory& trajectory, const SplinePathOptions& options);

  int64_t begin_ns() const { return begin_ns_; }
  int64_t end_ns() const { return end_ns_; }
  // A stamp within [begin_ns, end_ns], or up to a few ms outside.
  PathState At(int64_t stamp_ns) const {
    return AtSeconds(1e-9 * static_cast<double>(stamp_ns - begin_ns_));
  }
  // Seconds from begin_ns.
  PathState AtSeconds(double time_s) const;
  // Hash of everything that determines the path.
  uint64_t Hash() const;

 private:
  int64_t begin_ns_;
  int64_t end_ns_;
  UniformSpline position_;
  UniformSpline rotation_;
};

}  // namespace pangea::sim
