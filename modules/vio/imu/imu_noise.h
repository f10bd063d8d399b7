#pragma once

// How noisy an IMU really is where it is mounted. The white noise of a data sheet is that of a
// sensor on a table; the rotors of a drone make it 20 to 40 times as much (EuRoC's MH flights: 0.07
// instead of 0.002 m/s^2/sqrt(Hz)), and an estimator that does not know believes the IMU too much.
// Published values are as often far too large (a calibration that put the motion into the noise),
// and then scale is lost: the accelerometer alone tells it.

#include <Eigen/Core>
#include <span>

#include "core/imu/imu.h"

namespace pangea::vio {

// `given` within what the samples allow. Motion is smooth from sample to sample, so their third
// differences are noise (variance 20 sigma^2): white noise is hardly more than they show, and not
// less than a share of it.
ImuNoise MeasuredNoise(const ImuNoise& given, std::span<const ImuSample> samples);

// Random walks within what the parts of phones and cameras have.
ImuNoise WithUsualWalks(ImuNoise given);

// Means, and variances summed over the axes, of the samples as they are, motion and noise alike.
struct SampleMoments {
  Eigen::Vector3d gyro_mean = Eigen::Vector3d::Zero();   // rad/s
  Eigen::Vector3d accel_mean = Eigen::Vector3d::Zero();  // m/s^2
  double gyro_variance = 0;
  double accel_variance = 0;
};
SampleMoments MomentsOf(std::span<const ImuSample> samples);

}  // namespace pangea::vio
