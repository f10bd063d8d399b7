#pragma once

// What calibration leaves of an IMU's scale factors and axes, and what the IMU factor says of them:
// omega = (I + S_g) omega_m - b_g, a = (I + S_a) a_m - b_a (docs/maths_vio.md).

#include <Eigen/Core>
#include <span>

#include "core/imu/imu.h"
#include "core/imu/preintegration.h"

namespace pangea::vio {

// Their error is plain: the columns of S_g, then those of S_a.
inline constexpr int kImuIntrinsicsSize = 18;

struct ImuIntrinsics {
  Eigen::Matrix3d gyro = Eigen::Matrix3d::Zero();   // S_g
  Eigen::Matrix3d accel = Eigen::Matrix3d::Zero();  // S_a

  ImuSample Corrected(const ImuSample& sample) const;
  Eigen::Matrix<double, kImuIntrinsicsSize, 1> Stacked() const;
  void Add(const Eigen::Matrix<double, kImuIntrinsicsSize, 1>& error);
  // Of the body whose axes are the gyro's: what rotated the gyro rotates the accelerometer (to
  // first order; docs/decisions/imu.md).
  ImuIntrinsics OfGyroAxes() const;
};

// A preintegration, and what the IMU intrinsics do to it (to first order, about those it was made
// with).
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

// What is measured at these IMU intrinsics; with the biases that it was made with.
Preintegration At(const ScaledPreintegration& span, const ImuIntrinsics& intrinsics);
// The derivative of the residual `r` at those IMU intrinsics by them.
Eigen::Matrix<double, 15, kImuIntrinsicsSize> ImuIntrinsicsJacobian(
    const ScaledPreintegration& span, const ImuIntrinsics& intrinsics,
    const Eigen::Vector3d& gyro_bias, const Eigen::Vector3d& r_theta);

}  // namespace pangea::vio
