#include "thinning/relative_pose.h"

#include <Eigen/Cholesky>
#include <cmath>

namespace pangea {

RelativePose RelativePose::Inverse() const {
  return {T_from_to.Inverse(), InverseCovariance(T_from_to, covariance)};
}

RelativePose Compose(const RelativePose& a, const RelativePose& b) {
  return {a.T_from_to * b.T_from_to,
          ComposeCovariance(a.T_from_to, a.covariance, b.T_from_to, b.covariance)};
}

RelativePose Average(const RelativePose& a, const RelativePose& b) {
  // x = a + K (b - a), K = A (A + B)^-1: so neither covariance need be inverted by itself.
  const Eigen::LDLT<Matrix6d> sum(a.covariance + b.covariance);
  const Matrix6d gain = sum.solve(a.covariance).transpose();
  RelativePose mean;
  mean.T_from_to = a.T_from_to.Plus(gain * b.T_from_to.Minus(a.T_from_to));
  // Joseph's form stays positive definite, however different A and B are; A - K A does not.
  const Matrix6d rest = Matrix6d::Identity() - gain;
  const Matrix6d covariance =
      rest * a.covariance * rest.transpose() + gain * b.covariance * gain.transpose();
  mean.covariance = 0.5 * (covariance + covariance.transpose());
  return mean;
}

double LogDeterminant(const RelativePose& relative) {
  return Eigen::LDLT<Matrix6d>(relative.covariance).vectorD().array().log().sum();
}

}  // namespace pangea
