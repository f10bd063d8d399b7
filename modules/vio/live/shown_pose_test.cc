#include "vio/live/shown_pose.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace pangea::vio {
namespace {

const MapId kShownMap{1, 100};
const MapId kOther{2, 50};

Correction MakeCorrection(int64_t revision, const MapId& group, const Rigid3& T_map_odom) {
  Correction correction;
  correction.map = kShownMap;
  correction.group = group;
  correction.revision = revision;
  correction.T_map_odom = T_map_odom;
  return correction;
}

const Rigid3 kFar{YawRotation(0.7), {40, -20, 1}};

TEST(ShownPose, IsTheOdometryWithoutACorrection) {
  ShownPose shown;
  shown.Reset(kShownMap);
  EXPECT_LT(shown.Show(0, kFar).Minus(kFar).norm(), 1e-12);
}

TEST(ShownPose, BlendsACorrectionAtABoundedRateAndArrives) {
  ShownPose shown;
  shown.Reset(kShownMap);
  Rigid3 last = shown.Show(0, kFar);
  const Rigid3 drift{YawRotation(0.05), {0.4, -0.3, 0.1}};
  ASSERT_TRUE(shown.Correct(MakeCorrection(3, kShownMap, drift)));
  EXPECT_EQ(shown.revision(), 3);
  for (int i = 1; i <= 200; ++i) {
    const Rigid3 now = shown.Show(i * 50'000, kFar);
    EXPECT_LE((now.t - last.t).norm(), ShownPose::kMaxSpeed * 0.05 + 1e-9);
    EXPECT_LE(now.q.angularDistance(last.q), ShownPose::kMaxYawRate * 0.05 + 1e-9);
    last = now;
  }
  EXPECT_LT(last.Minus(drift * kFar).norm(), 1e-9);
}

// A walk 800 m from the odom origin, at 20 images per second, corrected after the first image.
// Returns the largest step of the shown pose, m, beyond the odometry's own motion.
double LargestJump(const Rigid3& T_map_odom, Rigid3* last_error) {
  ShownPose shown;
  shown.Reset(kShownMap);
  const auto odometry = [](int image) {
    return Rigid3{YawRotation(0.02 * image), {640 + 0.06 * image, 480, 1}};
  };
  Rigid3 last = shown.Show(0, odometry(0));
  EXPECT_TRUE(shown.Correct(MakeCorrection(1, kShownMap, T_map_odom)));
  double largest = 0;
  for (int image = 1; image <= 400; ++image) {
    const Rigid3 now = shown.Show(image * 50'000, odometry(image));
    const Rigid3 own = odometry(image - 1).Inverse() * odometry(image);
    largest = std::max(largest, ((last.Inverse() * now).t - own.t).norm());
    last = now;
  }
  *last_error = last * (T_map_odom * odometry(400)).Inverse();
  return largest;
}

TEST(ShownPose, AYawCorrectionFarFromTheOriginMovesThePositionAtTheBoundedSpeed) {
  Rigid3 error;
  // About the origin: 4 m sideways where the body is.
  EXPECT_LE(LargestJump({YawRotation(0.005), {0, 0, 0}}, &error),
            ShownPose::kMaxSpeed * 0.05 + 1e-9);
  EXPECT_LT(error.Minus(Rigid3{}).norm(), 1e-6);
}

TEST(ShownPose, ARotationAboutTheBodyDoesNotMoveIt) {
  const Rigid3 to_body{Eigen::Quaterniond::Identity(), {640, 480, 1}};
  const Rigid3 rotation = to_body * Rigid3{YawRotation(0.1), {0, 0, 0}} * to_body.Inverse();
  Rigid3 error;
  // During the rotation (one second) the body walks on: 0.1 rad over 6 cm per image.
  EXPECT_LE(LargestJump(rotation, &error), 0.1 * 0.06 + 1e-9);
  EXPECT_LT(error.Minus(Rigid3{}).norm(), 1e-6);
}

TEST(ShownPose, ANewFrameHoldsAtOnce) {
  ShownPose shown;
  shown.Reset(kShownMap);
  shown.Show(0, kFar);
  const Rigid3 fused{YawRotation(2.0), {100, 0, 0}};
  ASSERT_TRUE(shown.Correct(MakeCorrection(1, kOther, fused)));
  EXPECT_LT(shown.Show(50'000, kFar).Minus(fused * kFar).norm(), 1e-9);
}

TEST(ShownPose, TheHighestRevisionWinsAndOtherMapsAreNotOurs) {
  ShownPose shown;
  shown.Reset(kShownMap);
  const Rigid3 newer{YawRotation(0.0), {1, 0, 0}};
  EXPECT_TRUE(shown.Correct(MakeCorrection(5, kOther, newer)));
  EXPECT_FALSE(shown.Correct(MakeCorrection(4, kOther, kFar)));
  EXPECT_FALSE(shown.Correct(MakeCorrection(5, kOther, kFar)));
  Correction foreign = MakeCorrection(9, kOther, kFar);
  foreign.map = {1, 101};
  EXPECT_FALSE(shown.Correct(foreign));
  EXPECT_LT(shown.Show(0, Rigid3{}).Minus(newer).norm(), 1e-12);
  shown.Reset({1, 101});
  EXPECT_EQ(shown.revision(), 0);
  EXPECT_TRUE(shown.Correct(foreign));
}

}  // namespace
}  // namespace pangea::vio
