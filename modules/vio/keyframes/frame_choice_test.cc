#include "vio/keyframes/frame_choice.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/testing/test_cameras.h"

namespace pangea::vio {
namespace {

constexpr int kFrameTracks = 20;
constexpr int64_t kFirstFrame_us = 1'000'000;

// A window of a first frame, which is a keyframe, and a second one.
struct Pair {
  CameraModel camera = PinholeTestCamera(640, 480, 400);
  FrameChoice choice{EstimatorOptions{}, camera};
  WindowState state;
  TrackHistory history;

  // Adds a frame that sees the first `tracks` landmarks, each displaced by `shift_px`.
  WindowFrame& Add(double at_s, double shift_px, int tracks) {
    WindowFrame frame;
    frame.utime = kFirstFrame_us + std::llround(1e6 * at_s);
    state.frames.push_back(frame);
    TrackedFrame tracked{frame.utime, {}};
    for (int i = 0; i < tracks; ++i) {
      const double x = -0.5 + 0.05 * i;
      tracked.observations.push_back(
          {i, Eigen::Vector2f::Zero(), {x + shift_px * camera.PixelAngle(), 0.02 * i}, 1});
    }
    history.AddFrame(tracked, camera, 1e-3);
    return state.frames.back();
  }
  Pair() {
    Add(0, 0, kFrameTracks);
    choice.Choose(history, &state);
  }
  const WindowFrame& Second(double at_s, double shift_px, int tracks = kFrameTracks) {
    Add(at_s, shift_px, tracks);
    choice.Choose(history, &state);
    return state.frames.back();
  }
};

TEST(FrameChoice, TheFirstFrameIsAKeyframe) {
  const Pair pair;
  EXPECT_TRUE(pair.state.frames[0].is_keyframe);
  EXPECT_TRUE(pair.state.frames[0].is_window_keyframe);
}

TEST(FrameChoice, AFrameIsAWindowKeyframeWhenTheImageHasMoved) {
  EXPECT_FALSE(Pair().Second(0.1, 14).is_window_keyframe);
  EXPECT_TRUE(Pair().Second(0.1, 16).is_window_keyframe);
  EXPECT_TRUE(Pair().Second(0.1, 0, 13).is_window_keyframe)
      << "less than 0.7 of the tracks are left";
  EXPECT_FALSE(Pair().Second(0.1, 0, 14).is_window_keyframe);
}

TEST(FrameChoice, AKeyframeWantsMoreAndATimeApart) {
  EXPECT_FALSE(Pair().Second(0.3, 19).is_keyframe);
  EXPECT_TRUE(Pair().Second(0.3, 21).is_keyframe);
  EXPECT_FALSE(Pair().Second(0.1, 21).is_keyframe) << "too soon";
  EXPECT_TRUE(Pair().Second(0.3, 0, 9).is_keyframe) << "less than half of the tracks are left";
  EXPECT_TRUE(Pair().Second(5.1, 0).is_keyframe) << "after so long in any case";
  EXPECT_TRUE(Pair().Second(5.1, 0).is_window_keyframe);
}

TEST(FrameChoice, RotationIsTakenOut) {
  Pair pair;
  WindowFrame& frame = pair.Add(0.3, 30, kFrameTracks);
  // The camera looks along the body's z axis here: a rotation about y shifts the rays near the
  // middle equally.
  frame.imu.T_odom_body.q = ExpSo3({0, -30 * pair.camera.PixelAngle(), 0});
  pair.choice.Choose(pair.history, &pair.state);
  EXPECT_FALSE(pair.state.frames[1].is_window_keyframe);
  EXPECT_FALSE(pair.state.frames[1].is_keyframe);
}

TEST(FrameChoice, StandingStillIsHeldByTheFrameItBeganWith) {
  const auto is_window_keyframe = [](bool first_stationary, int tracks) {
    Pair pair;
    pair.state.frames[0].stationary = first_stationary;
    pair.Add(0.3, 25, tracks).stationary = true;
    pair.choice.Choose(pair.history, &pair.state);
    EXPECT_FALSE(pair.state.frames[1].is_keyframe);
    return pair.state.frames[1].is_window_keyframe;
  };
  EXPECT_TRUE(is_window_keyframe(false, kFrameTracks));
  EXPECT_FALSE(is_window_keyframe(true, kFrameTracks));
  EXPECT_FALSE(is_window_keyframe(true, 10));
  EXPECT_TRUE(is_window_keyframe(true, 9)) << "handed on before its tracks run out";
}

TEST(FrameChoice, WithNothingInCommonAFrameIsAWindowKeyframe) {
  Pair pair;
  pair.state.frames[0].pose_only = true;
  EXPECT_TRUE(pair.Second(0.1, 0).is_window_keyframe);
}

}  // namespace
}  // namespace pangea::vio
