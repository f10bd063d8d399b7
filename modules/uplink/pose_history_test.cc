#include "uplink/pose_history.h"

#include <gtest/gtest.h>

#include "uplink/test_ids.h"

namespace pangea {
namespace {

constexpr int64_t kFrame_us = 50'000;

Rigid3 Pose(double s) { return {ExpSo3({0, 0, 0.1 * s}), {s, 2 * s, 0}}; }

PoseHistory TenPoses() {
  PoseHistory history;
  for (int i = 0; i < 10; ++i) {
    history.AddPose(i * kFrame_us, kMap, Pose(i));
  }
  return history;
}

TEST(PoseHistory, LiesBetweenTwoPoses) {
  const PoseHistory history = TenPoses();
  EXPECT_LT(history.At(3 * kFrame_us, kMap)->Minus(Pose(3)).norm(), 1e-12);
  EXPECT_LT(history.At(3 * kFrame_us + kFrame_us / 2, kMap)->Minus(Pose(3.5)).norm(), 1e-12);
  EXPECT_FALSE(history.At(-1, kMap));
  EXPECT_FALSE(history.At(9 * kFrame_us + 1, kMap)) << "the pose after it is still to come";
  EXPECT_FALSE(history.At(3 * kFrame_us, {1, 11})) << "another map";
}

TEST(PoseHistory, NotOverAGap) {
  PoseHistory history;
  history.AddPose(0, kMap, Pose(0));
  history.AddPose(PoseHistory::kMaxGap_us + 1, kMap, Pose(1));
  EXPECT_FALSE(history.At(1, kMap));
}

TEST(PoseHistory, KeyframesSayWhereAndLivePosesHowItMoved) {
  PoseHistory history = TenPoses();
  const Rigid3 wrong{ExpSo3({0.01, 0, 0.02}), {0.1, 0.2, 0.3}};  // all live poses, by as much
  EXPECT_FALSE(history.IsSettled(3 * kFrame_us, kMap));
  history.AddKeyframe(2 * kFrame_us, kMap, wrong * Pose(2));
  EXPECT_FALSE(history.IsSettled(3 * kFrame_us, kMap));
  EXPECT_LT(history.At(3 * kFrame_us, kMap)->Minus(wrong * Pose(3)).norm(), 1e-12);
  history.AddKeyframe(6 * kFrame_us, kMap, wrong * Pose(6));
  EXPECT_TRUE(history.IsSettled(3 * kFrame_us, kMap));
  for (const int i : {0, 2, 3, 6, 8}) {
    EXPECT_LT(history.At(i * kFrame_us, kMap)->Minus(wrong * Pose(i)).norm(), 1e-12) << i;
  }
}

TEST(PoseHistory, BetweenTwoKeyframesTheNearerOneCountsMore) {
  PoseHistory history;
  for (int i = 0; i < 5; ++i) {
    history.AddPose(i * kFrame_us, kMap, Rigid3());
  }
  history.AddKeyframe(0, kMap, {Eigen::Quaterniond::Identity(), {0, 0, 0}});
  history.AddKeyframe(4 * kFrame_us, kMap, {Eigen::Quaterniond::Identity(), {4, 0, 0}});
  EXPECT_NEAR(history.At(kFrame_us, kMap)->t.x(), 1, 1e-12);
  EXPECT_NEAR(history.At(3 * kFrame_us, kMap)->t.x(), 3, 1e-12);
}

TEST(PoseHistory, ForgetsWhatIsOldAndEarlierMaps) {
  PoseHistory history;
  for (int64_t utime = 0; utime <= PoseHistory::kLength_us + kFrame_us; utime += kFrame_us) {
    history.AddPose(utime, kMap, Pose(0));
  }
  EXPECT_FALSE(history.At(0, kMap));
  EXPECT_TRUE(history.At(kFrame_us, kMap));
  EXPECT_FALSE(history.IsSettled(2 * kFrame_us, kMap));
  history.AddPose(0, {1, 11}, Pose(5));
  EXPECT_LT(history.At(2 * kFrame_us, kMap)->Minus(Pose(0)).norm(), 1e-12) << "it has just ended";
  EXPECT_TRUE(history.IsSettled(2 * kFrame_us, kMap));
  EXPECT_LT(history.At(0, {1, 11})->Minus(Pose(5)).norm(), 1e-12);
  EXPECT_FALSE(history.IsSettled(0, {1, 11}));
  history.AddPose(0, {1, 12}, Pose(0));
  EXPECT_FALSE(history.At(2 * kFrame_us, kMap));
}

}  // namespace
}  // namespace pangea
