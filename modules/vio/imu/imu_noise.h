#pragma once

// How noisy an IMU really is where it is mounted. The white noise of a data sheet is that of a
// sensor on a table; the rotors of a drone make it 20 to 40 times as much (EuRoC's MH flights: 0.07
// instead of 0.002 m/s^2/sqrt(Hz)), and an estimator that does not know believes the IMU too much.

#include <Eigen/Core>
#include <span>

#include "core/imu/imu.h"

namespace pangea::vio {

// `least` with its white noise densities raised to a share of what the samples show: motion is
// smooth from sample to sample, so their second differences are noise (variance 6 sigma^2).
ImuNoise MeasuredNoise(const ImuNoise& least, std::span<const ImuSample> samples);

// Means, and variances summed over the axes, of the samples as they are, motion and noise alike.
struct SampleMoments {
  Eigen::Vector3d gyro_mean = Eigen::Vector3d::Zero();   // rad/s
  Eigen::Vector3d accel_mean = Eigen::Vector3d::Zero();  // m/s^2
  double gyro_variance = 0;
  double accel_variance = 0;
};
SampleMoments MomentsOf(std::span<const ImuSample> samples);

}  // namespace pangea::vio
