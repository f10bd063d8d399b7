#pragma once

// Residuals of the joint window bundle adjustment, with analytic Jacobians. (joint_ba.h)
//
// A pose block is 7 doubles (quaternion x y z w, translation) with the project's tangent (dp,
// dtheta) in the left frame. RigidManifold's PlusJacobian is [I6; 0], so a factor writes its
// derivative by the tangent into the first six columns and zero into the seventh.

#include <ceres/manifold.h>
#include <ceres/sized_cost_function.h>

#include "core/rigid3.h"

namespace pangea {

Rigid3 PoseFromBlock(const double* block);
void PoseToBlock(const Rigid3& pose, double* block);

class RigidManifold : public ceres::Manifold {
 public:
  int AmbientSize() const override { return 7; }
  int TangentSize() const override { return 6; }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override;
  bool PlusJacobian(const double* x, double* jacobian) const override;
  bool Minus(const double* y, const double* x, double* y_minus_x) const override;
  bool MinusJacobian(const double* x, double* jacobian) const override;
};

// Blocks: host pose T_w_body (7), target pose T_w_body (7), point (3) = (x, y, inverse depth) in
// the host's camera. r = S (pi(p_target_cam) - ray).
class ReprojectionFactor : public ceres::SizedCostFunction<2, 7, 7, 3> {
 public:
  ReprojectionFactor(const Rigid3& T_body_cam_host, const Rigid3& T_body_cam_target,
                     const Eigen::Vector2d& ray, const Eigen::Matrix2d& sqrt_info)
      : T_body_cam_host_(T_body_cam_host),
        T_cam_body_target_(T_body_cam_target.Inverse()),
        ray_(ray),
        sqrt_info_(sqrt_info) {}
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  Rigid3 T_body_cam_host_;
  Rigid3 T_cam_body_target_;
  Eigen::Vector2d ray_;
  Eigen::Matrix2d sqrt_info_;
};

// What the host's map knows of a point. Blocks: point (3), log scale kappa of its window (1): the
// window is truly exp(kappa) times as large as its odometry says.
// r = [S (xy - ray); (rho - exp(-kappa) rho_0) / sigma_rho].
class PointPriorFactor : public ceres::SizedCostFunction<3, 3, 1> {
 public:
  PointPriorFactor(const Eigen::Vector2d& ray, const Eigen::Matrix2d& sqrt_info,
                   double inverse_depth, double inverse_depth_sigma)
      : ray_(ray), sqrt_info_(sqrt_info), rho_(inverse_depth), sigma_(inverse_depth_sigma) {}
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  Eigen::Vector2d ray_;
  Eigen::Matrix2d sqrt_info_;
  double rho_;
  double sigma_;
};

// An odometry edge. Blocks: from's T_w_body (7), to's T_w_body (7), log scale kappa (1). Covariance
// L L^T in from's body frame;
//   kWorld:    r = L^-1 [t_rel - exp(kappa) t; Log(R_rel R^T)]
//   kOdometry: r = L^-1 [exp(-kappa) t_rel - t; Log(R_rel R^T)]
// In the world's metres a scale that only its prior holds would shrink until the residuals are
// nothing.
class EdgeFactor : public ceres::SizedCostFunction<6, 7, 7, 1> {
 public:
  enum class Metres { kWorld, kOdometry };

  EdgeFactor(const Rigid3& T_from_to, const Matrix6d& covariance, Metres metres = Metres::kWorld);
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  Rigid3 T_from_to_;
  Matrix6d sqrt_info_;
  Metres metres_;
};

// r = kappa / sigma.
class ScalePriorFactor : public ceres::SizedCostFunction<1, 1> {
 public:
  explicit ScalePriorFactor(double sigma) : sigma_(sigma) {}
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  double sigma_;
};

}  // namespace pangea
