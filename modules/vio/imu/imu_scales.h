#pragma once

// What calibration leaves of an IMU's scales and axes, and what the inertial factor says of them:
// omega = (I + S_g) omega_m - b_g, a = (I + S_a) a_m - b_a (docs/maths_vio.md).

#include <Eigen/Core>
#include <span>

#include "core/imu/imu.h"
#include "core/imu/preintegration.h"

namespace pangea::vio {

// Their error is plain: the columns of S_g, then those of S_a.
inline constexpr int kScalesSize = 18;

struct ImuScales {
  Eigen::Matrix3d gyro = Eigen::Matrix3d::Zero();   // S_g
  Eigen::Matrix3d accel = Eigen::Matrix3d::Zero();  // S_a

  ImuSample Corrected(const ImuSample& sample) const;
  Eigen::Matrix<double, kScalesSize, 1> Stacked() const;
  void Add(const Eigen::Matrix<double, kScalesSize, 1>& error);
  // Of the body whose axes are the gyro's: what turned the gyro turns the accelerometer (to first
  // order; docs/decisions/imu_scales.md).
  ImuScales OfGyroAxes() const;
};

// A preintegration, and what the scales do to it (to first order, about those it was made with).
struct ScaledPreintegration {
  Preintegration measured;
  ImuScales scales;
  Eigen::Matrix<double, 9, kScalesSize> jacobian = Eigen::Matrix<double, 9, kScalesSize>::Zero();
};
ScaledPreintegration IntegrateScaled(std::span<const ImuSample> samples, const ImuNoise& noise,
                                     const ImuScales& scales, const Eigen::Vector3d& gyro_bias,
                                     const Eigen::Vector3d& accel_bias);

// What is measured at these scales; with the biases that it was made with.
Preintegration At(const ScaledPreintegration& span, const ImuScales& scales);
// The derivative of the residual `r` at those scales by the scales.
Eigen::Matrix<double, 15, kScalesSize> ScalesJacobian(const ScaledPreintegration& span,
                                                      const ImuScales& scales,
                                                      const Eigen::Vector3d& gyro_bias,
                                                      const Eigen::Vector3d& r_theta);

}  // namespace pangea::vio
