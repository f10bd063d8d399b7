#include "calibration/collector.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "calibration/calibration_test_world.h"

namespace pangea::calibration {
namespace {

// Rotates about x and z of the camera; y comes later.
TestWorldOptions Briskly(double seconds, Eigen::Vector3d rotation_rms) {
  return {.seed = 5, .seconds = seconds, .image_hz = 20, .rotation_rms = std::move(rotation_rms)};
}

Input WithKnownRotation(const TestWorldOptions& options) {
  TestWorld world = MakeTestWorld(options);
  world.input.q_body_cam = world.truth.camera.T_body_cam.q;
  return world.input;
}

TEST(RoughCoverage, OfBriskRotationGrowsWithTheTime) {
  const Coverage half = RoughCoverage(WithKnownRotation(Briskly(10, {0.5, 0.6, 0.4})));
  EXPECT_NEAR(half.Share(), half.seconds / kGood_s, 1e-9);
  EXPECT_NEAR(half.Share(), 0.5, 0.05);
  EXPECT_EQ(RoughCoverage(WithKnownRotation(Briskly(25, {0.5, 0.6, 0.4}))).Share(), 1);
}

TEST(RoughCoverage, LacksTheAxisThatIsNotRotatedAbout) {
  const Coverage coverage = RoughCoverage(WithKnownRotation(Briskly(25, {0.5, 0.02, 0.4})));
  EXPECT_EQ(coverage.RotationShare(0), 1);
  EXPECT_LT(coverage.RotationShare(1), 0.5);
  EXPECT_EQ(coverage.RotationShare(2), 1);
  EXPECT_EQ(coverage.Share(), coverage.RotationShare(1));
}

TEST(RoughCoverage, CountsSecondsWhateverTheRateOfImages) {
  for (const double image_hz : {12.0, 15.0, 30.0}) {
    TestWorldOptions options = Briskly(15, {0.5, 0.6, 0.4});
    options.image_hz = image_hz;
    EXPECT_NEAR(RoughCoverage(WithKnownRotation(options)).seconds, 15, 0.5) << image_hz;
  }
}

TEST(RoughCoverage, IsNothingOfNothing) { EXPECT_EQ(RoughCoverage({}).Share(), 0); }

cv::Mat Noise(int seed) {
  cv::Mat image(48, 64, CV_8U);
  cv::RNG rng(static_cast<uint64_t>(seed));
  rng.fill(image, cv::RNG::UNIFORM, 0, 256);
  return image;
}

TEST(Collector, ForgetsWhatIsOld) {
  Collector collector(64, 48, ImuNoise{}, std::nullopt);
  for (int i = 0; i < 10; ++i) {
    collector.AddImage(1000 * i, Noise(i));
    collector.AddImu({.utime = 1000 * i});
  }
  collector.Forget(6000);
  ASSERT_EQ(collector.input().frames.size(), 4U);
  ASSERT_EQ(collector.input().imu.size(), 4U);
  EXPECT_EQ(collector.input().frames.front().utime, 6000);
  EXPECT_EQ(collector.input().imu.front().utime, 6000);
}

// A browser may report a motion event without values, or twice.
TEST(Collector, TakesOnlyPlausibleInputInTheOrderOfTime) {
  Collector collector(64, 48, ImuNoise{}, std::nullopt);
  for (const int64_t utime : {1000, 2000, 2000, 1500, 3000}) {
    collector.AddImu({.utime = utime});
    collector.AddImage(utime, Noise(static_cast<int>(utime)));
  }
  collector.AddImu({.utime = 4000, .gyro = Eigen::Vector3d(0, std::nan(""), 0)});
  ASSERT_EQ(collector.input().imu.size(), 3U);
  ASSERT_EQ(collector.input().frames.size(), 3U);
  EXPECT_EQ(collector.input().imu.back().utime, 3000);
  EXPECT_EQ(collector.input().frames.back().utime, 3000);
}

}  // namespace
}  // namespace pangea::calibration
