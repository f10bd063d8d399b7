#pragma once

namespace pangea {

// A robust loss: the cost rho(|r|^2) / 2, and the weight rho' for iteratively reweighted least
// squares. Huber (1964) or Cauchy.
struct RobustLoss {
  enum class Kind { kNone, kHuber, kCauchy };
  Kind kind = Kind::kNone;
  double scale = 1;  // residual from which the loss grows slower, in sigmas

  double Cost(double squared_residual) const;
  double Weight(double squared_residual) const;
};

// Huber's cost and weight, of the absolute residual.
inline double HuberCost(double residual, double scale) {
  return residual <= scale ? 0.5 * residual * residual : scale * (residual - 0.5 * scale);
}
inline double HuberWeight(double residual, double scale) {
  return residual <= scale ? 1.0 : scale / residual;
}

}  // namespace pangea
