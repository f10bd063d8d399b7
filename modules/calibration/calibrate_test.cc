#include "calibration/calibrate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "calibration/calibration_test_world.h"
#include "calibration/search.h"
#include "core/axis_aligned.h"
#include "core/rigid3.h"

namespace pangea::calibration {
namespace {

using testing::HasSubstr;
using testing::Not;

TestWorldOptions Short(uint64_t seed) {
  return {.seed = seed, .seconds = 14, .image_hz = 20, .num_points = 700};
}

// 99.9 % bounds of the mean of `worlds` squared standard normals, by Wilson and Hilferty.
std::pair<double, double> NeesBounds(int worlds) {
  const double n = worlds, k = 2.0 / (9 * n), z = 3.29;
  return {std::pow(1 - k - z * std::sqrt(k), 3), std::pow(1 - k + z * std::sqrt(k), 3)};
}

TEST(Calibrate, IsAsFarOffAsItSays) {
  constexpr int kWorlds = 20;
  Tangent nees = Tangent::Zero(), largest = Tangent::Zero();
  for (uint64_t seed = 1; seed <= kWorlds; ++seed) {
    TestWorldOptions options = Short(seed);
    options.slower = 1.4;
    options.interval_share = -0.4;
    TestWorld world = MakeTestWorld(options);
    // This IMU is exact.
    world.input.imu_noise.axes_sigma = world.input.imu_noise.gyro_scale_sigma = 0;
    world.input.least_gyro_scale_sigma = 0;
    const Result result = Calibrate(world.input);
    EXPECT_EQ(result.refused, "") << seed;
    const Tangent off = result.parameters.Minus(world.truth);
    nees += off.cwiseQuotient(result.sigma).cwiseAbs2() / kWorlds;
    largest = largest.cwiseMax(off.cwiseAbs());
  }
  const auto [low, high] = NeesBounds(kWorlds);
  for (int row = 0; row < kSize; ++row) {
    EXPECT_GT(nees[row], low) << row;
    EXPECT_LT(nees[row], high) << row;
  }
  EXPECT_LT(largest[kLogFocal], 0.01);
  EXPECT_LT(largest.segment<3>(kRotation).maxCoeff(), 0.01);
  EXPECT_LT(largest[kTimeOffset], 0.001);
}

TEST(Calibrate, ImagesMayComeAtFiveHertz) {
  TestWorldOptions options = Short(1);
  options.seconds = 30;
  options.image_hz = 5;
  const TestWorld world = MakeTestWorld(options);
  const Result result = Calibrate(world.input);
  EXPECT_EQ(result.refused, "");
  EXPECT_NEAR(result.parameters.Minus(world.truth)[kLogFocal], 0, 0.02);
}

// An error of a stamp shifts a whole image, so its residuals are not independent.
TEST(Calibrate, StampsThatJitterMakeItLessSure) {
  TestWorldOptions options = Short(3);
  const Result exact = Calibrate(MakeTestWorld(options).input);
  options.stamp_sigma_s = 0.004;
  const TestWorld world = MakeTestWorld(options);
  const Result result = Calibrate(world.input);
  EXPECT_EQ(result.refused, "");
  EXPECT_GT(result.sigma[kTimeOffset], 2 * exact.sigma[kTimeOffset]);
  const Tangent off = result.parameters.Minus(world.truth).cwiseQuotient(result.sigma);
  EXPECT_LT(off.cwiseAbs().maxCoeff(), 4);
}

// In the dark the camera exposes longer and takes fewer images; its stamps are at the end of the
// exposure, but its middle matters.
TEST(Calibrate, FindsTheOffsetThatGrowsWithTheInterval) {
  TestWorldOptions options = Short(10);
  options.seconds = 18;
  options.image_hz = 30;
  options.slower = 1.5;
  options.interval_share = -0.5;
  const TestWorld world = MakeTestWorld(options);
  const Result result = Calibrate(world.input);
  EXPECT_EQ(result.refused, "");
  EXPECT_NEAR(result.parameters.interval_share, -0.5, 4 * result.sigma[kIntervalShare]);
  EXPECT_LT(result.sigma[kIntervalShare], 0.1);
  EXPECT_LT(result.sigma_px, 1.2 * options.pixel_sigma);
  // Half of the images have an offset of a sixtieth of a second, relative to that of the usual
  // interval.
  EXPECT_NEAR(result.time_offset_spread_s, 0.5 / 60 * std::sqrt(0.5), 0.002);
}

// Outliers as in real tracks: they neither bias the lens nor prevent convergence.
TEST(Calibrate, OutliersMatterLittle) {
  TestWorldOptions options = Short(11);
  options.seconds = 20;
  options.outlier_share = 0.15;
  options.pixel_sigma = 0.6;
  const TestWorld world = MakeTestWorld(options);
  const Result result = Calibrate(world.input);
  EXPECT_EQ(result.refused, "");
  const Tangent off = result.parameters.Minus(world.truth).cwiseQuotient(result.sigma);
  EXPECT_LT(off.cwiseAbs().maxCoeff(), 4);
  EXPECT_LT(std::abs(result.parameters.camera.distortion[0] - world.truth.camera.distortion[0]),
            0.008);
}

TEST(Calibrate, RefusesRotationAboutOneAxis) {
  TestWorldOptions options = Short(5);
  options.rotation_rms = {1e-4, 0.6, 1e-4};
  const Result result = Calibrate(MakeTestWorld(options).input);
  EXPECT_THAT(result.refused, HasSubstr("rotate more"));
}

TEST(Calibrate, RefusesACameraThatDoesNotRotate) {
  TestWorldOptions options = Short(6);
  options.rotation_rms.setConstant(1e-4);
  EXPECT_THAT(Calibrate(MakeTestWorld(options).input).refused, Not(""));
}

TEST(Calibrate, RefusesAGyroscopeInDegrees) {
  TestWorld world = MakeTestWorld(Short(7));
  for (ImuSample& sample : world.input.imu) {
    sample.gyro *= 180 / M_PI;
  }
  EXPECT_THAT(Calibrate(world.input).refused, Not(""));
}

TEST(Calibrate, TakesWhatIsKnown) {
  TestWorld world = MakeTestWorld(Short(8));
  world.input.q_body_cam = world.truth.camera.T_body_cam.q;
  world.input.field_of_view = 2 * std::atan(0.5 * world.truth.camera.width / world.truth.camera.fx);
  const Result result = Calibrate(world.input);
  EXPECT_EQ(result.refused, "");
  EXPECT_EQ(result.next_cost, 0);  // no other rotation was tried
}

TEST(Calibrate, RefusesGivenAxesThatAreWrongAndNamesTheRightOnes) {
  TestWorld world = MakeTestWorld(Short(9));
  const Eigen::Quaterniond right = NearestAxisAligned(world.truth.camera.T_body_cam.q);
  world.input.check_rotation = true;
  world.input.q_body_cam = right;
  EXPECT_EQ(Calibrate(world.input).refused, "");
  for (const Eigen::Vector3d& turn : {Eigen::Vector3d(M_PI / 2, 0, 0), Eigen::Vector3d(0, M_PI, 0),
                                      Eigen::Vector3d(0, 0, -M_PI / 2)}) {
    world.input.q_body_cam = right * ExpSo3(turn);
    const Result result = Calibrate(world.input);
    EXPECT_THAT(result.refused, HasSubstr("as given: the points say " + AxesOf(right)));
    ASSERT_TRUE(result.better_q_body_cam);
    EXPECT_EQ(AxesOf(*result.better_q_body_cam), AxesOf(right));
  }
}

// From these axes the solver finds a local minimum, which fits the points worse.
TEST(Calibrate, RefusesGivenAxesWithALocalMinimum) {
  TestWorldOptions options = Short(9);
  options.seconds = 12;
  TestWorld world = MakeTestWorld(options);
  Eigen::Matrix3d R;
  R << 0, 1, 0, 0, 0, -1, -1, 0, 0;
  world.input.q_body_cam = Eigen::Quaterniond(R);
  world.input.check_rotation = true;
  EXPECT_THAT(Calibrate(world.input).refused, HasSubstr("do not point along the IMU's -z,x,-y"));
}

// The motion does not determine the axes, so the given ones decide.
TEST(Calibrate, TakesGivenAxesWhereTheMotionDoesNotTell) {
  TestWorldOptions options = Short(3);
  options.rotation_rms = {1e-4, 0.6, 1e-4};
  TestWorld world = MakeTestWorld(options);
  world.input.q_body_cam = NearestAxisAligned(world.truth.camera.T_body_cam.q);
  world.input.check_rotation = true;
  EXPECT_THAT(Calibrate(world.input).refused, Not(HasSubstr("as given")));
}

TEST(Calibrate, NamesAxes) {
  Eigen::Matrix3d R;  // of a phone's back camera
  R << 0, -1, 0, -1, 0, 0, 0, 0, -1;
  EXPECT_EQ(AxesOf(Eigen::Quaterniond(R) * ExpSo3({0.2, -0.3, 0.1})), "-y,-x,-z");
}

}  // namespace
}  // namespace pangea::calibration
