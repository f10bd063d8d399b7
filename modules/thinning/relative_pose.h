#pragma once

// A relative pose of two keyframes with covariance; composition, inverse and average, to first
// order.

#include "core/rigid3.h"

namespace pangea {

struct RelativePose {
  Rigid3 T_from_to;
  Matrix6d covariance;  // (translation, rotation) in from's body frame

  RelativePose Inverse() const;
};

// The relative pose from a's first to b's second keyframe, for independent errors.
RelativePose Compose(const RelativePose& a, const RelativePose& b);
// The weighted mean of two independent measurements of the same relative pose.
RelativePose Average(const RelativePose& a, const RelativePose& b);
// log det(covariance): the smaller, the more certain. The entropy of a Gaussian is half of it plus
// a constant.
double LogDeterminant(const RelativePose& relative);

}  // namespace pangea
