#pragma once

namespace pangea {

// rho(|r|^2) / 2, and the weight rho' of iterated reweighting (Huber 1964; Cauchy's).
struct RobustLoss {
  enum class Kind { kNone, kHuber, kCauchy };
  Kind kind = Kind::kNone;
  double scale = 1;  // sigmas

  double Cost(double squared_residual) const;
  double Weight(double squared_residual) const;
};

}  // namespace pangea
