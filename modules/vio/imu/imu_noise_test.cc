#include "vio/imu/imu_noise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "core/testing/test_random.h"

namespace pangea::vio {
namespace {

// A shaken hand: 4 Hz, 3 m/s^2 and 1 rad/s, at 200 Hz.
std::vector<ImuSample> Shaken(double gyro_density, double accel_density) {
  std::mt19937_64 rng(5);
  std::vector<ImuSample> samples;
  for (int i = 0; i < 200; ++i) {
    const double t = 0.005 * i;
    const double s = std::sin(2 * M_PI * 4 * t);
    samples.push_back(
        {1'000'000 + 5'000 * i,
         Eigen::Vector3d(s, 0.3, 0) + RandomVector(rng, gyro_density * std::sqrt(200)),
         Eigen::Vector3d(0, 3 * s, kGravity) + RandomVector(rng, accel_density * std::sqrt(200))});
  }
  return samples;
}

TEST(MeasuredNoise, FindsVibration) {
  const ImuNoise noise = MeasuredNoise(ImuNoise{}, Shaken(3e-3, 7e-2));
  EXPECT_NEAR(noise.gyro_noise_density, 0.3 * 3e-3, 1.2e-4);
  EXPECT_NEAR(noise.accel_noise_density, 0.3 * 7e-2, 2.4e-3);
  EXPECT_EQ(noise.gyro_random_walk, ImuNoise{}.gyro_random_walk);
}

TEST(MeasuredNoise, TakesMotionForNoNoise) {
  const ImuNoise noise = MeasuredNoise(ImuNoise{}, Shaken(1.7e-4, 2e-3));
  EXPECT_LT(noise.gyro_noise_density, 2e-4);
  EXPECT_LT(noise.accel_noise_density, 2.2e-3);
}

TEST(MeasuredNoise, IsNeverBelowTheDataSheet) {
  const ImuNoise noise = MeasuredNoise(ImuNoise{}, Shaken(0, 0));
  EXPECT_GE(noise.gyro_noise_density, ImuNoise{}.gyro_noise_density);
  EXPECT_GE(noise.accel_noise_density, ImuNoise{}.accel_noise_density);
  EXPECT_EQ(MeasuredNoise(ImuNoise{}, {}).accel_noise_density, ImuNoise{}.accel_noise_density);
}

TEST(MomentsOf, AreThoseOfTheSamples) {
  const std::vector<ImuSample> samples = {{0, {1, 0, 2}, {3, 0, 9}}, {1, {3, 0, 2}, {3, 4, 9}}};
  const SampleMoments moments = MomentsOf(samples);
  EXPECT_EQ(moments.gyro_mean, Eigen::Vector3d(2, 0, 2));
  EXPECT_EQ(moments.accel_mean, Eigen::Vector3d(3, 2, 9));
  EXPECT_EQ(moments.gyro_variance, 1);
  EXPECT_EQ(moments.accel_variance, 4);
}

}  // namespace
}  // namespace pangea::vio
