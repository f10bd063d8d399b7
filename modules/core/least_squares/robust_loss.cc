#include "core/least_squares/robust_loss.h"

#include <cmath>

namespace pangea {

double RobustLoss::Cost(double squared_residual) const {
  const double b = scale * scale;
  switch (kind) {
    case Kind::kHuber:
      return squared_residual <= b ? 0.5 * squared_residual
                                   : scale * std::sqrt(squared_residual) - 0.5 * b;
    case Kind::kCauchy:
      return 0.5 * b * std::log1p(squared_residual / b);
    default:
      return 0.5 * squared_residual;
  }
}

double RobustLoss::Weight(double squared_residual) const {
  const double b = scale * scale;
  switch (kind) {
    case Kind::kHuber:
      return squared_residual <= b ? 1 : scale / std::sqrt(squared_residual);
    case Kind::kCauchy:
      return 1 / (1 + squared_residual / b);
    default:
      return 1;
  }
}

}  // namespace pangea
