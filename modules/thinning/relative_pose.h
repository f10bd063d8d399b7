#pragma once

// A relative pose of two keyframes with its covariance, composed, inverted and averaged, all to
// first order.

#include "core/rigid3.h"

namespace pangea {

struct RelativePose {
  Rigid3 T_from_to;
  Matrix6d covariance;  // (translation, rotation) in from's body frame

  RelativePose Inverse() const;
};

// From a's first to b's second keyframe; their errors are independent.
RelativePose Compose(const RelativePose& a, const RelativePose& b);
// The weighted mean of two independent measurements of the same.
RelativePose Average(const RelativePose& a, const RelativePose& b);
// The smaller the better known: the logarithm of the covariance's determinant, which the entropy of
// a Gaussian is but for a factor and a constant.
double LogDeterminant(const RelativePose& relative);

}  // namespace pangea
