#include "vio/imu/imu_noise.h"

#include <algorithm>
#include <cmath>

namespace pangea::vio {
namespace {

constexpr size_t kMinSamples = 20;  // fewer are not significant
// Allows for errors that are not white but act as noise: motion between samples, stamps, cross-axis
// sensitivity. Chosen among 1, 2 and 4 (docs/decisions/imu.md).
constexpr double kMaxShare = 2;
// Noise of usual IMUs (rad/s/sqrt(Hz), m/s^2/sqrt(Hz)): a given value up to this is accepted,
// whatever a few rounded samples show.
constexpr double kUsualGyroDensity = 2e-4, kUsualAccelDensity = 2e-3;
// Range of random walks (rad/s^2/sqrt(Hz), m/s^3/sqrt(Hz)), around those of EuRoC's IMU and of
// phones. A minute of samples hardly shows them, so the range is chosen: an accelerometer walk that
// is far too small costs more than one three times too large (docs/decisions/imu.md).
constexpr double kMinGyroWalk = 1e-5, kMaxGyroWalk = 2e-4;
constexpr double kMinAccelWalk = 1e-3, kMaxAccelWalk = 3e-3;

using Channel = Eigen::Vector3d ImuSample::*;

// Mean square of the third differences of means of `count` samples each.
double SquaredThirdDifferences(std::span<const ImuSample> samples, Channel of, size_t count) {
  const auto mean = [&](size_t first) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (size_t i = first; i < first + count; ++i) {
      sum += samples[i].*of;
    }
    return Eigen::Vector3d(sum / static_cast<double>(count));
  };
  double sum = 0;
  const size_t last = samples.size() - 4 * count;
  for (size_t i = 0; i <= last; ++i) {
    sum += (mean(i) - 3 * mean(i + count) + 3 * mean(i + 2 * count) - mean(i + 3 * count))
               .squaredNorm();
  }
  return sum / static_cast<double>(last + 1);
}

double Density(double given, double usual, std::span<const ImuSample> samples, Channel of) {
  const double n = static_cast<double>(samples.size());
  const double dt =
      1e-6 * static_cast<double>(samples.back().utime - samples.front().utime) / (n - 1);
  const double single = SquaredThirdDifferences(samples, of, 1);
  if (!(single > 0)) {
    return given;
  }
  // For white noise, single samples have twice the variance of means of pairs. For vibration (a few
  // spectral lines) the ratio is larger, and vibration averages out in the integration accordingly.
  const double white_share = std::min(1.0, 2 * SquaredThirdDifferences(samples, of, 2) / single);
  const double shown = std::sqrt(dt * single / (20 * 3));
  return std::clamp(given, white_share * shown, std::max(kMaxShare * shown, usual));
}

// Largest mean square change, per axis, between samples that are at most `gap_us` apart, or next to
// each other.
double LargestChange(std::span<const ImuSample> samples, Channel of, int64_t gap_us) {
  double largest = 0;
  for (size_t lag = 1; lag < samples.size(); ++lag) {
    double sum = 0;
    int count = 0;
    for (size_t i = 0; i + lag < samples.size(); ++i) {
      if (lag == 1 || samples[i + lag].utime - samples[i].utime <= gap_us) {
        sum += (samples[i + lag].*of - samples[i].*of).squaredNorm() / 3;
        ++count;
      }
    }
    if (count == 0) {
      break;
    }
    largest = std::max(largest, sum / count);
  }
  return largest;
}

}  // namespace

ImuNoise WithUnseenMotion(const ImuNoise& given, int64_t gap_us,
                          std::span<const ImuSample> samples) {
  // Variance of a mean rate over the gap to a density; the mean is off by half of the changes.
  const double share_s = 0.25 * 1e-6 * static_cast<double>(gap_us);
  ImuNoise noise = given;
  noise.gyro_noise_density =
      std::hypot(given.gyro_noise_density,
                 std::sqrt(share_s * LargestChange(samples, &ImuSample::gyro, gap_us)));
  noise.accel_noise_density =
      std::hypot(given.accel_noise_density,
                 std::sqrt(share_s * LargestChange(samples, &ImuSample::accel, gap_us)));
  return noise;
}

ImuNoise WithUsualWalks(ImuNoise given) {
  given.gyro_random_walk = std::clamp(given.gyro_random_walk, kMinGyroWalk, kMaxGyroWalk);
  given.accel_random_walk = std::clamp(given.accel_random_walk, kMinAccelWalk, kMaxAccelWalk);
  return given;
}

ImuNoise MeasuredNoise(const ImuNoise& given, std::span<const ImuSample> samples) {
  ImuNoise noise = given;
  if (samples.size() >= kMinSamples) {
    noise.gyro_noise_density =
        Density(given.gyro_noise_density, kUsualGyroDensity, samples, &ImuSample::gyro);
    noise.accel_noise_density =
        Density(given.accel_noise_density, kUsualAccelDensity, samples, &ImuSample::accel);
  }
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
