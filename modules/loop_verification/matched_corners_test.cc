#include "loop_verification/matched_corners.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "loop_verification/loop_verification_test_world.h"
#include "loop_verification/window_cache.h"

namespace pangea {
namespace {

constexpr int kNewest = 10;

class MatchedCorners : public testing::Test {
 protected:
  // Keyframes whose corners are not landmarks.
  void Walk(const TestAgentOptions& options) {
    agent_ = RunTestAgent(MakeTestRoom({}), options);
    for (Keyframe& keyframe : agent_.keyframes) {
      keyframe.points.clear();
      for (Corner& corner : keyframe.corners) {
        corner.landmark_id = kNoLandmark;
      }
      store_.Add(keyframe);
    }
  }
  Window MakeWindowUpTo(int seq, int count, const WindowOptions& options = {}) {
    return MakeWindow(store_.WindowUpTo(agent_.keyframes[seq].id, count), options);
  }
  // Squared error of the inverse depth / its variance; empty for a corner without a point.
  double SquaredError(const Window& window, const WindowLandmark& landmark) const {
    const auto seq = static_cast<size_t>(window.newest_keyframe().id.seq);
    const int point = agent_.point_of_corner[seq][landmark.host.corner];
    if (point < 0) {
      return INFINITY;
    }
    const Rigid3 T_room_cam = agent_.T_room_body[seq] * window.newest_keyframe().camera.T_body_cam;
    const double depth = (T_room_cam.Inverse() * agent_.room[point].p_room).z();
    const double error = (landmark.inverse_depth - 1 / depth) / landmark.inverse_depth_sigma;
    return error * error;
  }

  TestAgent agent_;
  KeyframeStore store_;
};

TEST_F(MatchedCorners, DepthsAreAsCertainAsTheyClaim) {
  double squares = 0;
  int good = 0, wrong = 0;
  for (int run = 0; run < 5; ++run) {
    TestAgentOptions options;
    options.map = {1, 1000 + run};
    options.start_angle = 0.7 * run;
    Walk(options);
    const Window window = MakeWindowUpTo(kNewest, 5);
    for (const WindowLandmark& landmark : window.landmarks) {
      EXPECT_EQ(landmark.host.frame, window.newest());
      EXPECT_GE(landmark.observations.size(), 2u);
      const double squared = SquaredError(window, landmark);
      const bool right = squared < 25;
      (right ? good : wrong) += 1;
      squares += right ? squared : 0;
    }
  }
  EXPECT_GT(good, 5 * 60);
  EXPECT_LT(wrong, good / 50);
  EXPECT_GT(squares / good, 0.5);
  EXPECT_LT(squares / good, 1.5);
}

TEST_F(MatchedCorners, KeyframesBehindTriangulateTheFirstOfAMap) {
  Walk({});
  EXPECT_TRUE(MakeWindowUpTo(0, 5).landmarks.empty());
  const KeyframeId first = agent_.keyframes[0].id;
  const Window window = MakeWindow(store_.WindowUpTo(first, 5), {}, store_.WindowBehind(first, 4));
  EXPECT_EQ(window.newest(), 0);
  EXPECT_GT(window.landmarks.size(), 60u);
  for (const WindowLandmark& landmark : window.landmarks) {
    EXPECT_EQ(landmark.observations.size(), 1u);
    EXPECT_EQ(window.landmark_of_corner[0][landmark.host.corner],
              static_cast<int>(&landmark - window.landmarks.data()));
  }
}

TEST_F(MatchedCorners, AWindowThatHasEnoughGetsNone) {
  Walk({});
  WindowOptions none;
  none.triangulation.few_landmarks = -1;
  EXPECT_TRUE(MakeWindowUpTo(kNewest, 5, none).landmarks.empty());
}

TEST_F(MatchedCorners, AnOdometryThatDoesNotKnowItsWayGivesNoDepth) {
  TestAgentOptions options;
  options.edge_sigma_m = 0.05;
  Walk(options);
  EXPECT_TRUE(MakeWindowUpTo(kNewest, 5).landmarks.empty());
}

TEST_F(MatchedCorners, AKeptWindowIsThatOfItsKeyframes) {
  Walk({});
  const auto sums = [](const Window& window) {
    double depths = 0;
    for (const WindowLandmark& landmark : window.landmarks) {
      depths += landmark.inverse_depth;
    }
    return std::pair(window.landmarks.size(), depths);
  };
  WindowCache cache;
  for (int round = 0; round < 2; ++round) {
    for (const int seq : {kNewest, kNewest + 1}) {
      const KeyframeId& id = agent_.keyframes[seq].id;
      const KeyframeWindow frames = store_.WindowUpTo(id, 5);
      for (const KeyframeWindow& after : {KeyframeWindow{}, store_.WindowBehind(id, 4)}) {
        EXPECT_EQ(sums(*cache.Make(frames, {}, after)), sums(MakeWindow(frames, {}, after)));
      }
    }
  }
}

}  // namespace
}  // namespace pangea
