#include "common/link/map_continuity.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace pangea {
namespace {

using testing::HasSubstr;

Keyframe At(int32_t seq, int64_t utime) {
  Keyframe keyframe;
  keyframe.id = {{1, 1000}, seq};
  keyframe.utime = utime;
  keyframe.camera.width = 640;
  return keyframe;
}

TEST(MapContinuity, TakesAMapInAnyOrderAndRepeats) {
  MapContinuity continuity;
  for (const int seq : {0, 1, 4, 2, 3, 2, 0, 4}) {
    EXPECT_EQ(continuity.Check(At(seq, 100 * seq), 5), "") << seq;
  }
}

TEST(MapContinuity, TimeGoesForwardWithSeq) {
  MapContinuity continuity;
  continuity.Check(At(1, 100), 5);
  continuity.Check(At(3, 300), 5);
  for (const auto& [seq, utime] : {std::pair{4, 300}, {4, 10}, {2, 100}, {2, 300}, {0, 100}}) {
    EXPECT_THAT(continuity.Check(At(seq, utime), 5), HasSubstr("time does not go forward"));
  }
  EXPECT_EQ(continuity.Check(At(4, 301), 5), "") << "what was refused is not remembered";
  Keyframe other = At(9, 5);
  other.id.map.opened_utime = 2000;
  EXPECT_EQ(continuity.Check(other, 5), "") << "another map has its own time";
}

TEST(MapContinuity, OneCameraAMapButItsMountingMayBeRefined) {
  MapContinuity continuity;
  continuity.Check(At(0, 100), 5);
  Keyframe keyframe = At(1, 200);
  keyframe.camera.T_body_cam.t.x() += 0.01;
  keyframe.camera.time_offset_s = 0.001;
  EXPECT_EQ(continuity.Check(keyframe, 5), "");
  keyframe = At(2, 300);
  keyframe.camera.fx += 1;
  EXPECT_THAT(continuity.Check(keyframe, 5), HasSubstr("another camera"));
}

TEST(MapContinuity, ASeqIsUsedOnce) {
  MapContinuity continuity;
  continuity.Check(At(0, 100), 5);
  EXPECT_THAT(continuity.Check(At(0, 100), 6), HasSubstr("used again"));
}

TEST(MapContinuity, ForgetsTheOldest) {
  MapContinuity continuity;
  for (int seq = 0; seq <= static_cast<int>(MapContinuity::kMaxKeyframes); ++seq) {
    continuity.Check(At(seq, 100 * seq), 5);
  }
  EXPECT_EQ(continuity.Check(At(0, 0), 6), "");
  EXPECT_NE(continuity.Check(At(2, 0), 6), "");
}

}  // namespace
}  // namespace pangea
