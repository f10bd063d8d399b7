#pragma once

// One Gauss-Newton step on the epipolar constraint of two views, over the rotation R from a to b
// (perturbed on the left, in b's axes) and the direction of translation t on its sphere:
//
//   e = t . (R a x b) / s,   de/dtheta = ((t . R a) b - (R a . b) t) / s,   de/dt = (R a x b) / s.
//
// The caller chooses the scale s (which can make e an angle), the weights and the priors.

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/rigid3.h"

namespace pangea {

class EpipolarStep {
 public:
  // t: of length 1. Pure rotation does not observe t; then `damping` keeps it where it is.
  EpipolarStep(const Eigen::Vector3d& t, double damping) : t_(t) {
    const Eigen::Vector3d u = t.unitOrthogonal();
    tangent_ << u, t.cross(u);
    H = Eigen::Matrix<double, 5, 5>::Identity() * damping;
    g.setZero();
  }

  // Adds a pair of unit rays. `a_in_b` is R a, the ray of the first view in axes of the second.
  void Add(const Eigen::Vector3d& a_in_b, const Eigen::Vector3d& b, double scale, double weight) {
    const Eigen::Vector3d normal = a_in_b.cross(b);
    const double e = t_.dot(normal) / scale;
    Eigen::Matrix<double, 5, 1> row;
    row.head<3>() = (t_.dot(a_in_b) * b - a_in_b.dot(b) * t_) / scale;
    row.tail<2>() = tangent_.transpose() * normal / scale;
    H += weight * row * row.transpose();
    g += weight * row * e;
  }

  void Apply(Eigen::Quaterniond* q, Eigen::Vector3d* t) const {
    const Eigen::Matrix<double, 5, 1> step = -H.ldlt().solve(g);
    *q = (ExpSo3(step.head<3>()) * *q).normalized();
    *t = (t_ + tangent_ * step.tail<2>()).normalized();
  }

  // The normal equations, in the order (rotation, the two tangent directions of t).
  Eigen::Matrix<double, 5, 5> H;
  Eigen::Matrix<double, 5, 1> g;

 private:
  Eigen::Vector3d t_;
  Eigen::Matrix<double, 3, 2> tangent_;
};

}  // namespace pangea
