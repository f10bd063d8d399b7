#pragma once

// Measures the noise of an IMU as it is mounted. A data sheet gives the white noise of a sensor on
// a table; the rotors of a drone raise it 20 to 40 times (EuRoC's MH flights: 0.07 instead of 0.002
// m/s^2/sqrt(Hz)), and an estimator that does not know this trusts the IMU too much. Published
// values are as often far too large (the calibration counted motion as noise); then the scale is
// lost, which only the accelerometer observes.

#include <Eigen/Core>
#include <span>

#include "core/imu/imu.h"

namespace pangea::vio {

// Returns `given` with its noise densities limited to what the samples allow. Motion is smooth from
// sample to sample, so third differences of samples are noise (variance 20 sigma^2). The density is
// at most twice the measured one (or the usual one, if that is more), and at least the white share
// of the measured one.
ImuNoise MeasuredNoise(const ImuNoise& given, std::span<const ImuSample> samples);

// Allows for the motion that a gap of `gap_us` in the samples hides, which is integrated as the
// mean of the samples at its ends. `samples`: those before the gap, and the one behind it. How much
// they change within such a time says how far that mean may be off; as white noise over the gap it
// is added to the densities.
ImuNoise WithUnseenMotion(const ImuNoise& given, int64_t gap_us,
                          std::span<const ImuSample> samples);

// Returns `given` with its random walks limited to the range of IMUs in phones and cameras.
ImuNoise WithUsualWalks(ImuNoise given);

// Mean of the samples, and variance summed over the axes; motion and noise are not separated.
struct SampleMoments {
  Eigen::Vector3d gyro_mean = Eigen::Vector3d::Zero();   // rad/s
  Eigen::Vector3d accel_mean = Eigen::Vector3d::Zero();  // m/s^2
  double gyro_variance = 0;
  double accel_variance = 0;
};
SampleMoments MomentsOf(std::span<const ImuSample> samples);

}  // namespace pangea::vio
