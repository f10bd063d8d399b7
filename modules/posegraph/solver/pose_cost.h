#pragma once

// The residual of one edge of the pose graph, with its Jacobians.
//
//   r = W [ Rz(yaw_i)^T (p_j - p_i) - t ;  wrap(yaw_j - yaw_i - yaw) ],   W = L^T (Whitening)
//
// With d = Rz(yaw_i)^T (p_j - p_i): dr/dp_i = -W Rz^T, dr/dp_j = W Rz^T,
// dd/dyaw_i = -z x d = (d.y, -d.x, 0).

#include <ceres/sized_cost_function.h>

#include "posegraph/solver/four_dof.h"

namespace pangea {

struct WeightedEdge {
  Relative4 measured;
  Matrix4d whitening;
  const double* sqrt_weight;
};

// Parameters: (x, y, z, yaw) of both keyframes. `sqrt_weight` multiplies the residual; it is read
// at each evaluation and must outlive the cost.
class RelativePoseCost : public ceres::SizedCostFunction<4, 4, 4> {
 public:
  RelativePoseCost(const Relative4& measured, const Matrix4d& whitening, const double* sqrt_weight)
      : edge_{measured, whitening, sqrt_weight} {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  WeightedEdge edge_;
};

// The same edge where one unit of the measurement is exp(kappa) metres of the map:
//   r = W [ exp(-kappa) Rz(yaw_i)^T (p_j - p_i) - t ;  wrap(yaw_j - yaw_i - yaw) ].
// Parameters: (x, y, z, yaw) of both keyframes, kappa.
class ScaledPoseCost : public ceres::SizedCostFunction<4, 4, 4, 1> {
 public:
  ScaledPoseCost(const Relative4& measured, const Matrix4d& whitening, const double* sqrt_weight)
      : edge_{measured, whitening, sqrt_weight} {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  WeightedEdge edge_;
};

}  // namespace pangea
