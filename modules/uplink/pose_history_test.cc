#include "uplink/pose_history.h"

#include <gtest/gtest.h>

namespace pangea {
namespace {

const MapId kMap{1, 10};
constexpr int64_t kFrame_us = 50'000;

Rigid3 Pose(double s) { return {ExpSo3({0, 0, 0.1 * s}), {s, 2 * s, 0}}; }

TEST(PoseHistory, LiesBetweenTwoPoses) {
  PoseHistory history;
  for (int i = 0; i < 10; ++i) {
    history.Add(i * kFrame_us, kMap, Pose(i));
  }
  EXPECT_LT(history.At(3 * kFrame_us, kMap)->Minus(Pose(3)).norm(), 1e-12);
  EXPECT_LT(history.At(3 * kFrame_us + kFrame_us / 2, kMap)->Minus(Pose(3.5)).norm(), 1e-12);
  EXPECT_FALSE(history.At(-1, kMap));
  EXPECT_FALSE(history.At(9 * kFrame_us + 1, kMap)) << "the pose after it is still to come";
  EXPECT_FALSE(history.At(3 * kFrame_us, {1, 11})) << "another map";
}

TEST(PoseHistory, NotOverAGap) {
  PoseHistory history;
  history.Add(0, kMap, Pose(0));
  history.Add(PoseHistory::kMaxGap_us + 1, kMap, Pose(1));
  EXPECT_FALSE(history.At(1, kMap));
}

TEST(PoseHistory, ForgetsWhatIsOldAndOtherMaps) {
  PoseHistory history;
  for (int64_t utime = 0; utime <= PoseHistory::kLength_us + kFrame_us; utime += kFrame_us) {
    history.Add(utime, kMap, Pose(0));
  }
  EXPECT_FALSE(history.At(0, kMap));
  EXPECT_TRUE(history.At(kFrame_us, kMap));
  history.Add(0, {1, 11}, Pose(0));
  EXPECT_FALSE(history.At(2 * kFrame_us, kMap));
}

}  // namespace
}  // namespace pangea
