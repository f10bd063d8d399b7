// Tests the gyro bias, the time offset and the closed-form start.

#include <gtest/gtest.h>

#include <cmath>

#include "vio/initialisation/initial_solution.h"
#include "vio/initialisation/start_test_world.h"

namespace pangea::vio {
namespace {

using Eigen::Vector3d;

std::optional<double> OffsetOf(const StartWorld& world) {
  return SolveTimeOffset(world.frames, kT_body_cam, world.samples, ImuNoise{});
}

TEST(SolveTimeOffset, FindsHowMuchLaterTheImagesWereTaken) {
  for (const double late_s : {-0.045, -0.02, 0.0235, 0.03, 0.05}) {
    const auto found = OffsetOf(Record(Lively, late_s, kStartRaySigma));
    ASSERT_TRUE(found) << late_s;
    EXPECT_NEAR(*found, late_s, 0.0015);
  }
}

TEST(SolveTimeOffset, SaysNothingWhenNothingIsGained) {
  EXPECT_FALSE(OffsetOf(Record(Lively, 0, kStartRaySigma)));
  EXPECT_FALSE(OffsetOf(Record(Lively, 0.001, kStartRaySigma)));
}

// At a constant rotation rate every offset explains the rotations equally well.
TEST(SolveTimeOffset, SaysNothingWhenTheRotationRateDoesNotVary) {
  EXPECT_FALSE(OffsetOf(Record(RotatingEvenly, 0.03, kStartRaySigma)));
}

TEST(SolveTimeOffset, SaysNothingBeyondWhatItSearches) {
  EXPECT_FALSE(OffsetOf(Record(Lively, 0.09, kStartRaySigma)));
}

TEST(SolveTimeOffset, SaysNothingWithoutEnoughSamplesOrTracks) {
  StartWorld world = Record(Lively, 0.03, kStartRaySigma);
  EXPECT_FALSE(SolveTimeOffset(world.frames, kT_body_cam, {}, ImuNoise{}));
  world.frames.resize(6);
  EXPECT_FALSE(OffsetOf(world));
}

TEST(SolveGyroBias, FindsTheBias) {
  const StartWorld world = Record(Lively, 0, kStartRaySigma);
  const auto bias = SolveGyroBias(world.frames, kT_body_cam, ImuNoise{});
  ASSERT_TRUE(bias);
  EXPECT_LT((*bias - kGyroBias).norm(), 2e-3);
}

TEST(SolveLinear, FindsVelocityGravityAndPoints) {
  const StartWorld world = Record(Lively, 0, 0);
  const auto start = SolveLinear(world.frames, kT_body_cam, ImuNoise{}, kGyroBias);
  ASSERT_TRUE(start);
  const Rigid3 T_odom_first = Lively(1);
  const auto R_first_odom = T_odom_first.q.conjugate();
  EXPECT_LT((start->v0 - R_first_odom * VelocityAt(Lively, 1)).norm(), 0.02);
  EXPECT_NEAR(start->gravity.norm(), kGravity, 1e-6);
  EXPECT_LT((start->gravity - R_first_odom * Vector3d(0, 0, -kGravity)).norm(), 0.1);
  ASSERT_EQ(start->T_first_body.size(), 21u);
  const Rigid3 T_first_last = T_odom_first.Inverse() * Lively(3);
  EXPECT_LT((start->T_first_body[20].t - T_first_last.t).norm(), 0.05);
  EXPECT_LT((start->v_first_body[20] - R_first_odom * VelocityAt(Lively, 3)).norm(), 0.05);
  EXPECT_EQ(start->p_first.size(), 80u);
}

}  // namespace
}  // namespace pangea::vio
