#pragma once

// Residuals of the global bundle adjustment, with analytic Jacobians, except those of landmarks
// (solver/eliminated_landmarks.h).
//
// Blocks: a pose T_map_body is 7 doubles (quaternion x y z w, translation) with the project's
// tangent (dp, dtheta) in the left frame; a motion is 9: velocity in the map frame (m/s), gyro bias
// (rad/s), accelerometer bias (m/s^2). A factor writes its derivative with respect to a pose's
// tangent into the first six columns, and zero into the seventh.

#include <ceres/sized_cost_function.h>

#include "core/imu/imu_factor.h"
#include "core/least_squares/edge_residual.h"
#include "global_ba/ba_world.h"

namespace pangea {

using MotionBlock = Eigen::Matrix<double, 9, 1>;

Rigid3 PoseFromBlock(const double* block);
void PoseToBlock(const Rigid3& pose, double* block);

KeyframeState StateFromBlocks(const double* pose, const double* motion);

// The preintegrated motion between two keyframes, with random walks of the biases
// (core/imu/imu_factor.h). Blocks: pose and motion of the first keyframe, pose and motion of the
// second.
class PreintegrationFactor : public ceres::SizedCostFunction<15, 7, 9, 7, 9> {
 public:
  PreintegrationFactor(const Preintegration& measured, const ImuNoise& noise);
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  Preintegration measured_;
  Eigen::Matrix<double, 15, 15> sqrt_info_;
};

// Zero-mean prior on the biases of a map's first keyframe: r = bias / sigma. Block: its motion.
class BiasPriorFactor : public ceres::SizedCostFunction<6, 9> {
 public:
  BiasPriorFactor(double gyro_sigma, double accel_sigma);
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  Eigen::Matrix<double, 6, 1> inverse_sigma_;
};

// Prior on the extrinsics: r = (T (-) prior) / sigma. Block: T_body_cam.
class CameraPriorFactor : public ceres::SizedCostFunction<6, 7> {
 public:
  CameraPriorFactor(const Rigid3& T_body_cam, double position_sigma, double rotation_sigma);
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  Rigid3 prior_;
  Vector6d inverse_sigma_;
};

// An odometry edge. Blocks: from's T_map_body (7), to's T_map_body (7), log scale kappa (1).
class EdgeFactor : public ceres::SizedCostFunction<6, 7, 7, 1> {
 public:
  explicit EdgeFactor(const EdgeResidual& residual) : residual_(residual) {}
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  EdgeResidual residual_;
};

// Prior on the log scale of a map's edges: r = kappa / sigma.
class ScalePriorFactor : public ceres::SizedCostFunction<1, 1> {
 public:
  explicit ScalePriorFactor(double sigma) : sigma_(sigma) {}
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  double sigma_;
};

}  // namespace pangea
