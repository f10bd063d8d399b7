#include "vio/imu/imu_noise.h"

#include <algorithm>
#include <cmath>

namespace pangea::vio {
namespace {

constexpr size_t kMinSamples = 20;  // fewer say little
// Vibration is a few lines of the spectrum, not white: second differences see all of it, motion
// integrates less. Of EuRoC's flights, 0.3 of the density serves better than all of it.
constexpr double kWhiteShare = 0.3;

}  // namespace

ImuNoise MeasuredNoise(const ImuNoise& least, std::span<const ImuSample> samples) {
  ImuNoise noise = least;
  if (samples.size() < kMinSamples) {
    return noise;
  }
  const double n = static_cast<double>(samples.size());
  const double dt =
      1e-6 * static_cast<double>(samples.back().utime - samples.front().utime) / (n - 1);
  double gyro = 0, accel = 0;
  for (size_t i = 2; i < samples.size(); ++i) {
    gyro += (samples[i].gyro - 2 * samples[i - 1].gyro + samples[i - 2].gyro).squaredNorm();
    accel += (samples[i].accel - 2 * samples[i - 1].accel + samples[i - 2].accel).squaredNorm();
  }
  const double to_density = kWhiteShare * kWhiteShare * dt / (6 * 3 * (n - 2));
  noise.gyro_noise_density = std::max(least.gyro_noise_density, std::sqrt(to_density * gyro));
  noise.accel_noise_density = std::max(least.accel_noise_density, std::sqrt(to_density * accel));
  return noise;
}

SampleMoments MomentsOf(std::span<const ImuSample> samples) {
  const auto count = static_cast<double>(samples.size());
  SampleMoments moments;
  for (const ImuSample& sample : samples) {
    moments.gyro_mean += sample.gyro / count;
    moments.accel_mean += sample.accel / count;
  }
  for (const ImuSample& sample : samples) {
    moments.gyro_variance += (sample.gyro - moments.gyro_mean).squaredNorm() / count;
    moments.accel_variance += (sample.accel - moments.accel_mean).squaredNorm() / count;
  }
  return moments;
}

}  // namespace pangea::vio
