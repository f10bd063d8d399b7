#include "vio/imu/imu_noise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "core/testing/test_random.h"

namespace pangea::vio {
namespace {

struct Shaking {
  double gyro_density = 0;
  double accel_density = 0;
  double vibration = 0;  // m/s^2, of a rotor at 70 Hz
};

// A shaken hand: 4 Hz, 3 m/s^2 and 1 rad/s, at 200 Hz.
std::vector<ImuSample> Shaken(const Shaking& shaking) {
  std::mt19937_64 rng(5);
  std::vector<ImuSample> samples;
  for (int i = 0; i < 200; ++i) {
    const double t = 0.005 * i;
    const double s = std::sin(2 * M_PI * 4 * t);
    const double vibration = shaking.vibration * std::sin(2 * M_PI * 70 * t);
    samples.push_back(
        {1'000'000 + 5'000 * i,
         Eigen::Vector3d(s, 0.3, 0) + RandomVector(rng, shaking.gyro_density * std::sqrt(200)),
         Eigen::Vector3d(vibration, 3 * s, kGravity) +
             RandomVector(rng, shaking.accel_density * std::sqrt(200))});
  }
  return samples;
}

ImuNoise Given(double gyro_density, double accel_density) {
  ImuNoise noise;
  noise.gyro_noise_density = gyro_density;
  noise.accel_noise_density = accel_density;
  return noise;
}

TEST(MeasuredNoise, RaisesWhatIsGivenFarTooSmall) {
  const ImuNoise noise = MeasuredNoise(Given(3e-5, 2e-3), Shaken({3e-4, 2e-2}));
  EXPECT_NEAR(noise.gyro_noise_density, 3e-4, 1e-4);
  EXPECT_NEAR(noise.accel_noise_density, 2e-2, 4e-3);
}

TEST(MeasuredNoise, LowersWhatIsGivenFarTooLarge) {
  const ImuNoise noise = MeasuredNoise(Given(3e-2, 0.18), Shaken({3e-4, 4e-3}));
  EXPECT_LT(noise.gyro_noise_density, 2e-3);
  EXPECT_GT(noise.gyro_noise_density, 3e-4);
  EXPECT_LT(noise.accel_noise_density, 0.02);
  EXPECT_GT(noise.accel_noise_density, 4e-3);
}

TEST(MeasuredNoise, TakesVibrationForLessThanWhiteNoise) {
  const Shaking vibrating{.gyro_density = 1.7e-4, .accel_density = 2e-3, .vibration = 2};
  const double white = 2 / std::sqrt(6.0) * std::sqrt(0.005);  // that would have its variance
  const ImuNoise noise = MeasuredNoise(ImuNoise{}, Shaken(vibrating));
  EXPECT_GT(noise.accel_noise_density, 0.05 * white);
  EXPECT_LT(noise.accel_noise_density, 0.5 * white);
}

TEST(MeasuredNoise, BelievesWhatTheSamplesAllow) {
  const ImuNoise given = Given(2.5e-4, 3e-3);
  const ImuNoise noise = MeasuredNoise(given, Shaken({1.7e-4, 2e-3}));
  EXPECT_EQ(noise.gyro_noise_density, given.gyro_noise_density);
  EXPECT_EQ(noise.accel_noise_density, given.accel_noise_density);
}

TEST(MeasuredNoise, OfExactOrFewSamplesIsWhatIsUsual) {
  EXPECT_EQ(MeasuredNoise(ImuNoise{}, Shaken({})).accel_noise_density,
            ImuNoise{}.accel_noise_density);
  EXPECT_EQ(MeasuredNoise(ImuNoise{}, {}).accel_noise_density, ImuNoise{}.accel_noise_density);
}

TEST(WithUnseenMotion, IsWhatTheSamplesChangeInSuchATime) {
  const ImuNoise given = Given(3e-4, 2e-2);
  // The largest change of the sine, on one axis of three: from crest to trough, in 125 ms.
  const ImuNoise noise = WithUnseenMotion(given, 200'000, Shaken({}));
  EXPECT_NEAR(noise.gyro_noise_density, std::sqrt(0.25 * 0.2 * 2 / 3), 0.01);
  EXPECT_NEAR(noise.accel_noise_density, 3 * std::sqrt(0.25 * 0.2 * 2 / 3), 0.03);
  const ImuNoise shorter = WithUnseenMotion(given, 40'000, Shaken({}));
  EXPECT_LT(shorter.gyro_noise_density, 0.3 * noise.gyro_noise_density);
}

TEST(WithUnseenMotion, OfAStillHandIsNone) {
  std::vector<ImuSample> still = Shaken({});
  for (ImuSample& sample : still) {
    sample.gyro = {0.1, 0, 0};
    sample.accel = {0, 0, kGravity};
  }
  const ImuNoise noise = WithUnseenMotion(Given(3e-4, 2e-2), 200'000, still);
  EXPECT_DOUBLE_EQ(noise.gyro_noise_density, 3e-4);
  EXPECT_DOUBLE_EQ(noise.accel_noise_density, 2e-2);
}

TEST(WithUsualWalks, BoundsThem) {
  ImuNoise given;
  given.gyro_random_walk = 2.6e-6;
  given.accel_random_walk = 0.024;
  EXPECT_EQ(WithUsualWalks(given).gyro_random_walk, 1e-5);
  EXPECT_EQ(WithUsualWalks(given).accel_random_walk, 3e-3);
  given.accel_random_walk = 3e-4;
  EXPECT_EQ(WithUsualWalks(given).accel_random_walk, 1e-3);
  EXPECT_EQ(WithUsualWalks(ImuNoise{}).accel_random_walk, ImuNoise{}.accel_random_walk);
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
