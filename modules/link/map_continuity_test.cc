#include "link/map_continuity.h"

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
  keyframe.camera.fx = keyframe.camera.fy = 500;
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

// The intrinsics may change when an odometry refines its calibration or the lens focuses.
TEST(MapContinuity, AMapsCameraMayMoveALittle) {
  MapContinuity continuity;
  continuity.Check(At(0, 100), 5);
  Keyframe keyframe = At(1, 200);
  keyframe.camera.T_body_cam.t.x() += 0.01;
  keyframe.camera.time_offset_s = 0.001;
  EXPECT_EQ(continuity.Check(keyframe, 5), "");
  int32_t seq = 2;
  for (double CameraModel::*const moves :
       {&CameraModel::fx, &CameraModel::fy, &CameraModel::cx, &CameraModel::cy}) {
    for (const double pixels : {-40.0, 0.01, 40.0}) {
      keyframe = At(seq, 100 * seq + 100);
      keyframe.camera.*moves += pixels;
      EXPECT_EQ(continuity.Check(keyframe, 5), "") << seq;
      ++seq;
    }
  }
  keyframe = At(seq, 100 * seq + 100);
  keyframe.camera.distortion << 0.3, -0.3, 0, 0;
  EXPECT_EQ(continuity.Check(keyframe, 5), "");
}

TEST(MapContinuity, AnotherCameraIsRefused) {
  MapContinuity continuity;
  continuity.Check(At(0, 100), 5);
  const auto refuses = [&](auto&& change) {
    Keyframe keyframe = At(1, 200);
    change(&keyframe.camera);
    EXPECT_THAT(continuity.Check(keyframe, 5), HasSubstr("another camera"));
  };
  refuses([](CameraModel* camera) { camera->kind = CameraModel::Kind::kEquidistant; });
  refuses([](CameraModel* camera) { camera->width = 752; });
  refuses([](CameraModel* camera) { camera->height = 480; });
  refuses([](CameraModel* camera) { camera->fx += 60; });
  refuses([](CameraModel* camera) { camera->fy -= 60; });
  refuses([](CameraModel* camera) { camera->cx += 60; });
  refuses([](CameraModel* camera) { camera->cy -= 60; });
  refuses([](CameraModel* camera) { camera->distortion[1] = 0.6; });
  refuses([](CameraModel* camera) { camera->distortion[3] = 0.01; });
  refuses([](CameraModel* camera) { camera->readout_s = 0.02; });
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
