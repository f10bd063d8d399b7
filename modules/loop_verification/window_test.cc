#include "loop_verification/window.h"

#include <gtest/gtest.h>

#include <utility>

#include "loop_verification/loop_verification_test_world.h"

namespace pangea {
namespace {

// Number of keyframes in the window of an agent with this distance between keyframes.
size_t NumFrames(double step_m, bool with_points = true, int num_keyframes = 20) {
  TestAgentOptions walk;
  walk.num_keyframes = num_keyframes;
  walk.radius = step_m / walk.step_angle;
  const TestAgent agent = RunTestAgent(MakeTestRoom({}), walk);
  KeyframeStore store;
  for (Keyframe keyframe : agent.keyframes) {
    if (!with_points) {
      keyframe.points.clear();
    }
    store.Add(std::move(keyframe));
  }
  const KeyframeWindow all = store.WindowUpTo(agent.keyframes.back().id, num_keyframes);
  const KeyframeWindow window = LastOfWindow(all);
  EXPECT_EQ(window.back(), all.back());
  return window.size();
}

TEST(WindowTest, GoesBackUntilDepthsAreSeen) {
  EXPECT_EQ(NumFrames(0.5), 5u);
  EXPECT_EQ(NumFrames(0.01), 10u);
  const size_t between = NumFrames(0.25);
  EXPECT_GT(between, 5u);
  EXPECT_LT(between, 10u);
}

TEST(WindowTest, WithoutDepthsGoesBackAsFarAsItMay) { EXPECT_EQ(NumFrames(0.5, false), 10u); }

TEST(WindowTest, IsNotLongerThanTheMap) { EXPECT_EQ(NumFrames(0.001, true, 8), 8u); }

}  // namespace
}  // namespace pangea
