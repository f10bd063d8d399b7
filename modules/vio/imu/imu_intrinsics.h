#pragma once

// Residual errors of an IMU's scale factors and axes after calibration, and their effect on the IMU
// factor: omega = (I + S_g) omega_m - b_g, a = (I + S_a) a_m - b_a (docs/maths_vio.md).

#include <Eigen/Core>
#include <span>

#include "core/imu/imu.h"
#include "core/imu/preintegration.h"

namespace pangea::vio {

// The error is a plain difference: the columns of S_g, then those of S_a.
inline constexpr int kImuIntrinsicsSize = 18;

struct ImuIntrinsics {
  Eigen::Matrix3d gyro = Eigen::Matrix3d::Zero();   // S_g
  Eigen::Matrix3d accel = Eigen::Matrix3d::Zero();  // S_a

  ImuSample Corrected(const ImuSample& sample) const;
  Eigen::Matrix<double, kImuIntrinsicsSize, 1> Stacked() const;
  void Add(const Eigen::Matrix<double, kImuIntrinsicsSize, 1>& error);
  // The same intrinsics for a body whose axes are the gyro's: the gyro's rotation is removed from
  // both sensors (first order; docs/decisions/imu.md).
  ImuIntrinsics OfGyroAxes() const;
};

// A preintegration with its Jacobian with respect to the IMU intrinsics (first order about
// `intrinsics`, with which it was made).
struct ScaledPreintegration {
  Preintegration measured;
  ImuIntrinsics intrinsics;
  Eigen::Matrix<double, 9, kImuIntrinsicsSize> jacobian =
      Eigen::Matrix<double, 9, kImuIntrinsicsSize>::Zero();
};
ScaledPreintegration IntegrateScaled(std::span<const ImuSample> samples, const ImuNoise& noise,
                                     const ImuIntrinsics& intrinsics,
                                     const Eigen::Vector3d& gyro_bias,
                                     const Eigen::Vector3d& accel_bias);

// The preintegration corrected to these IMU intrinsics, for unchanged biases.
Preintegration At(const ScaledPreintegration& span, const ImuIntrinsics& intrinsics);
// Jacobian of the IMU factor's residual with respect to the IMU intrinsics, at `intrinsics`.
Eigen::Matrix<double, 15, kImuIntrinsicsSize> ImuIntrinsicsJacobian(
    const ScaledPreintegration& span, const ImuIntrinsics& intrinsics,
    const Eigen::Vector3d& gyro_bias, const Eigen::Vector3d& r_theta);

}  // namespace pangea::vio
