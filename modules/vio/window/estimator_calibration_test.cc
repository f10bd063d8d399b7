// Tests that the estimator finds the errors of its calibration.

#include <gtest/gtest.h>

#include <iostream>

#include "vio/window/testing/test_ride.h"

namespace pangea::vio {
namespace {

TEST(Estimator, FindsATimeOffsetOfTensOfMilliseconds) {
  for (uint64_t seed = 1; seed <= 4; ++seed) {
    VioTestWorldOptions options;
    options.seed = seed;
    options.time_offset_sigma = 0.025;
    Ride ride(options);
    ride.Advance(100);
    ASSERT_EQ(ride.last.state, EstimatorState::kTracking) << ride.last.reason;
    std::cout << "time offset " << ride.world.true_time_offset_s() << " s, found "
              << ride.estimator.camera().time_offset_s << " s after " << ride.started_s << " s\n";
    EXPECT_NEAR(ride.estimator.camera().time_offset_s, ride.world.true_time_offset_s(), 0.003);
  }
}

// The error is about three times the sigma that is assumed for a calibration.
TEST(Estimator, FindsTheFocalLength) {
  for (const uint64_t seed : {2, 3}) {
    VioTestWorldOptions options;
    options.seed = seed;
    options.focal_sigma = 0.003;
    options.centre_sigma = 0.003;
    Ride ride(options);
    ride.Advance(300);
    ASSERT_EQ(ride.last.state, EstimatorState::kTracking) << ride.last.reason;
    const CameraModel& truth = ride.world.true_intrinsics();
    const CameraModel given = ride.world.camera(), found = ride.estimator.camera();
    std::cout << "off by " << given.fx - truth.fx << ", " << given.cx - truth.cx << ", "
              << given.cy - truth.cy << " px, now by " << found.fx - truth.fx << ", "
              << found.cx - truth.cx << ", " << found.cy - truth.cy << "\n";
    EXPECT_NEAR(found.fx / truth.fx, 1, 0.002);
    EXPECT_NEAR(found.fy / truth.fy, 1, 0.002);
    EXPECT_NEAR(found.cx, truth.cx, 0.6);
    EXPECT_NEAR(found.cy, truth.cy, 0.6);
  }
}

// A phone's lens without a calibrated distortion.
TEST(Estimator, FindsTheDistortion) {
  for (const uint64_t seed : {2, 3}) {
    VioTestWorldOptions options;
    options.seed = seed;
    options.unknown_distortion = 0.07;
    Ride ride(options);
    ride.Advance(300);
    ASSERT_EQ(ride.last.state, EstimatorState::kTracking) << ride.last.reason;
    const CameraModel &truth = ride.world.true_intrinsics(), found = ride.estimator.camera();
    for (const Eigen::Vector2d& pixel :
         {Eigen::Vector2d(320, 30), Eigen::Vector2d(60, 240), Eigen::Vector2d(560, 400)}) {
      const double error_px = truth.fx * (*found.Unproject(pixel) - *truth.Unproject(pixel)).norm();
      const double before_px =
          truth.fx * (*ride.world.camera().Unproject(pixel) - *truth.Unproject(pixel)).norm();
      std::cout << before_px << " px off, now " << error_px << "\n";
      EXPECT_LT(error_px, 0.2 * before_px);
    }
  }
}

}  // namespace
}  // namespace pangea::vio
