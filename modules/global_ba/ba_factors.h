#pragma once

// Residuals of the global bundle adjustment, with analytic Jacobians.
//
// Blocks: a pose T_map_body is 7 doubles with RigidManifold
// (loop_verification/joint_ba/ba_factors.h: tangent (dp, dtheta) in the left frame); a motion is 9:
// velocity in the map frame (m/s), gyro bias (rad/s), accelerometer bias (m/s^2); a landmark is its
// position in the map frame (metres).

#include <ceres/sized_cost_function.h>

#include "core/imu/imu_factor.h"

namespace pangea {

using MotionBlock = Eigen::Matrix<double, 9, 1>;

ImuState StateFromBlocks(const double* pose, const double* motion);

// A landmark in a camera: r = S (pi(T_cam_body T_map_body^-1 p) - ray). Blocks: pose, landmark,
// T_body_cam (7, as a pose).
// Behind the camera there is no ray: the residual of an outlier, without a slope, so that one point
// does not hold up all others.
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

// The preintegrated motion between two keyframes, and biases that wander
// (core/imu/imu_factor.h). Blocks: pose and motion of the first, pose and motion of the
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

// Biases of a map's first keyframe, about zero: r = bias / sigma. Block: its motion.
class BiasPriorFactor : public ceres::SizedCostFunction<6, 9> {
 public:
  BiasPriorFactor(double gyro_sigma, double accel_sigma);
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  Eigen::Matrix<double, 6, 1> inverse_sigma_;
};

// What is known of T_body_cam beforehand: r = (T (-) prior) / sigma. Block: T_body_cam.
class CameraPriorFactor : public ceres::SizedCostFunction<6, 7> {
 public:
  CameraPriorFactor(const Rigid3& T_body_cam, double position_sigma, double rotation_sigma);
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  Rigid3 prior_;
  Vector6d inverse_sigma_;
};

}  // namespace pangea
