#pragma once

// The same bundle adjustment solved by Ceres, as a reference for tests.

#include <ceres/loss_function.h>
#include <ceres/manifold.h>
#include <ceres/sized_cost_function.h>

#include "global_ba/ba_options.h"
#include "global_ba/ba_world.h"

namespace pangea {

// A pose of seven doubles with the project's tangent; its PlusJacobian is [I6; 0].
class RigidManifold : public ceres::Manifold {
 public:
  int AmbientSize() const override { return 7; }
  int TangentSize() const override { return 6; }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override;
  bool PlusJacobian(const double* x, double* jacobian) const override;
  bool Minus(const double* y, const double* x, double* y_minus_x) const override;
  bool MinusJacobian(const double* x, double* jacobian) const override;
};

// An observation of a landmark (eliminated_landmarks.h): r = S (pi(T_cam_body T_map_body^-1 p) -
// ray). Blocks: pose, landmark, T_body_cam (7, as a pose). For a point behind the camera the
// residual is a constant, that of an outlier, so that one point does not stop the optimisation.
class LandmarkFactor : public ceres::SizedCostFunction<2, 7, 3, 7> {
 public:
  LandmarkFactor(const Eigen::Vector2d& ray, const Eigen::Matrix2d& sqrt_info)
      : ray_(ray), sqrt_info_(sqrt_info) {}
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  Eigen::Vector2d ray_;
  Eigen::Matrix2d sqrt_info_;
};

// Solves to the minimum and returns its cost; only for metric maps. `loss`: of landmarks; takes
// ownership.
double SolveByCeres(const BaOptions& options, ceres::LossFunction* loss, BaWorld* world);

}  // namespace pangea
