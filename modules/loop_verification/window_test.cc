#include "loop_verification/window.h"

#include <gtest/gtest.h>

#include <utility>

#include "loop_verification/loop_verification_test_world.h"

namespace pangea {
namespace {

constexpr int kLast = 19;

WindowOptions FromTo(int num_keyframes, int max_keyframes) {
  WindowOptions options;
  options.num_keyframes = num_keyframes;
  options.max_keyframes = max_keyframes;
  options.min_baseline = 0.25;
  return options;
}

// How many keyframes the window has of an agent that walks this far from one to the next.
size_t NumFrames(double step_m, const WindowOptions& options, bool with_points = true) {
  TestAgentOptions walk;
  walk.num_keyframes = kLast + 1;
  walk.radius = step_m / walk.step_angle;
  const TestAgent agent = RunTestAgent(MakeTestRoom({}), walk);
  SubmapStore store;
  for (Keyframe keyframe : agent.keyframes) {
    if (!with_points) {
      keyframe.points.clear();
    }
    store.Add(std::move(keyframe));
  }
  const KeyframeWindow all = store.WindowUpTo(agent.keyframes[kLast].id, kLast + 1);
  const KeyframeWindow window = LastOfWindow(all, options);
  EXPECT_EQ(window.back(), all.back());
  return window.size();
}

TEST(WindowTest, GoesBackUntilDepthsAreSeen) {
  const WindowOptions options = FromTo(5, 10);
  EXPECT_EQ(NumFrames(0.5, options), 5u);
  EXPECT_EQ(NumFrames(0.01, options), 10u);
  const size_t between = NumFrames(0.25, options);
  EXPECT_GT(between, 5u);
  EXPECT_LT(between, 10u);
}

TEST(WindowTest, WithoutDepthsGoesBackAsFarAsItMay) {
  const WindowOptions options = FromTo(5, 10);
  EXPECT_EQ(NumFrames(0.5, options, false), 10u);
}

TEST(WindowTest, IsNotLongerThanTheMap) {
  const WindowOptions options = FromTo(5, 50);
  EXPECT_EQ(NumFrames(0.001, options), size_t{kLast + 1});
}

}  // namespace
}  // namespace pangea
