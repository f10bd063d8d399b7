// Tests how far a crowd or a bus that fills a part of the view moves the estimated pose along.

#include <gtest/gtest.h>

#include "vio/window/estimator.h"
#include "vio/window/testing/test_ride.h"

namespace pangea::vio {
namespace {

constexpr double kComes_s = 7, kSetsOff_s = 9;

VioTestWorldOptions CrowdOptions(double share, bool stands, bool sets_off, uint64_t seed) {
  VioTestWorldOptions options;
  options.seed = seed;
  options.imu_noise = {5e-4, 5e-5, 1e-2, 3e-3, 200};  // a phone's
  options.crowd_share = share;
  options.crowd_comes_s = kComes_s;
  options.crowd_moves_s = sets_off ? kSetsOff_s : kComes_s;
  options.crowd_end_s = options.crowd_moves_s + 3;
  options.crowd_sets_off = sets_off;
  if (stands) {
    options.stationary_begin_s = 5;
    options.stationary_end_s = 30;
  }
  return options;
}

// Error in metres of the motion from a second before the crowd comes to a second after it has gone;
// the crowd moves by 2.5 m or 3 m meanwhile.
double OffAfterCrowd(const VioTestWorldOptions& options) {
  Ride ride(options);
  ride.Advance(static_cast<int>((kComes_s - 1) * options.frame_rate_hz));
  EXPECT_EQ(ride.last.state, EstimatorState::kTracking) << ride.last.reason;
  const Ride::Frame before = ride.tracked.back();
  ride.Advance(static_cast<int>((options.crowd_end_s + 1 - kComes_s) * options.frame_rate_hz));
  EXPECT_EQ(ride.last.state, EstimatorState::kTracking) << ride.last.reason;
  const Ride::Frame& after = ride.tracked.back();
  const Eigen::Vector3d went = (before.result.T_odom_body.Inverse() * after.result.T_odom_body).t;
  const Eigen::Vector3d truth = (before.truth.T_odom_body.Inverse() * after.truth.T_odom_body).t;
  return (went - truth).norm();
}

// A crowd that stood in view and sets off moves the pose of a walking camera if it has more than
// half of the tracks (docs/maths_vio.md). So a walking camera is tested with a smaller crowd only.
TEST(Estimator, ACrowdDoesNotTakeThePoseAlong) {
  for (const double share : {0.4, 0.6, 0.8}) {
    EXPECT_LT(OffAfterCrowd(CrowdOptions(share, true, true, 1)), 0.25) << share;
    EXPECT_LT(OffAfterCrowd(CrowdOptions(share, true, false, 1)), 0.1) << share;
    EXPECT_LT(OffAfterCrowd(CrowdOptions(share, false, false, 1)), 0.15) << share;
  }
  EXPECT_LT(OffAfterCrowd(CrowdOptions(0.4, false, true, 1)), 0.15);
}

}  // namespace
}  // namespace pangea::vio
