#pragma once

// The Jacobian of f by central differences, to test analytic Jacobians. f takes an offset, a vector
// of `size` elements in the tangent of the analytic Jacobian, and returns a vector.

#include <Eigen/Core>

namespace pangea {

template <typename Function>
Eigen::MatrixXd NumericJacobian(int size, double step, const Function& f) {
  Eigen::MatrixXd J;
  for (int k = 0; k < size; ++k) {
    const Eigen::VectorXd offset = step * Eigen::VectorXd::Unit(size, k);
    const Eigen::VectorXd plus = f(offset);
    const Eigen::VectorXd minus = f(Eigen::VectorXd(-offset));
    J.conservativeResize(plus.size(), size);
    J.col(k) = (plus - minus) / (2 * step);
  }
  return J;
}

}  // namespace pangea
