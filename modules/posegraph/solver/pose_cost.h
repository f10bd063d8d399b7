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

// Parameters: (x, y, z, yaw) of both keyframes. `sqrt_weight` multiplies the residual; it is read
// at each evaluation and outlives the cost.
class RelativePoseCost : public ceres::SizedCostFunction<4, 4, 4> {
 public:
  RelativePoseCost(const Relative4& measured, const Matrix4d& whitening, const double* sqrt_weight)
      : measured_(measured), whitening_(whitening), sqrt_weight_(sqrt_weight) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  Relative4 measured_;
  Matrix4d whitening_;
  const double* sqrt_weight_;
};

// The same where the measurement's metres are exp(kappa) of the map's:
//   r = W [ exp(-kappa) Rz(yaw_i)^T (p_j - p_i) - t ;  wrap(yaw_j - yaw_i - yaw) ].
// Parameters: (x, y, z, yaw) of both keyframes, kappa.
class ScaledPoseCost : public ceres::SizedCostFunction<4, 4, 4, 1> {
 public:
  ScaledPoseCost(const Relative4& measured, const Matrix4d& whitening, const double* sqrt_weight)
      : measured_(measured), whitening_(whitening), sqrt_weight_(sqrt_weight) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  Relative4 measured_;
  Matrix4d whitening_;
  const double* sqrt_weight_;
};

// r = kappa / sigma.
class ScalePriorCost : public ceres::SizedCostFunction<1, 1> {
 public:
  explicit ScalePriorCost(double sigma) : sigma_(sigma) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  double sigma_;
};

}  // namespace pangea
