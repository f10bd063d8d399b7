#pragma once

// Two windows for tests of the joint bundle adjustment.

#include <gtest/gtest.h>

#include <vector>

#include "loop_verification/correspondences/projection_search.h"
#include "loop_verification/joint_ba/joint_ba.h"
#include "loop_verification/loop_verification_test_world.h"

namespace pangea {

// Two walks through one room, and the matches found with the true alignment; all are inliers.
class JointBaTestWindows : public testing::Test {
 protected:
  JointBaTestWindows() {
    const auto room = MakeTestRoom({.seed = 3, .num_points = 400});
    TestAgentOptions walk_m, walk_c;
    walk_m.num_keyframes = walk_c.num_keyframes = 6;
    walk_m.pixel_sigma = walk_c.pixel_sigma = 0.3;
    walk_c.map = {2, 2000};
    walk_c.radius = 2.3;
    const TestAgent agent_m = RunTestAgent(room, walk_m), agent_c = RunTestAgent(room, walk_c);
    for (const TestAgent* agent : {&agent_m, &agent_c}) {
      for (const Keyframe& keyframe : agent->keyframes) {
        store_.Add(keyframe);
      }
    }
    WindowOptions only_tracked;
    only_tracked.triangulation.few_landmarks = -1;
    m_ = MakeWindow(store_.WindowUpTo({walk_m.map, 5}, 5), only_tracked);
    c_ = MakeWindow(store_.WindowUpTo({walk_c.map, 5}, 5), only_tracked);
    T_m_c_ = m_.T_w_body.back() * agent_m.T_room_body[5].Inverse() * agent_c.T_room_body[5] *
             c_.T_w_body.back().Inverse();
    for (const Direction direction : kBothDirections) {
      for (int frame = 0; frame < 5; ++frame) {
        const SearchResult found =
            SearchByProjection(windows_, direction, frame, {T_m_c_, 1e-6 * Matrix6d::Identity()});
        matches_.insert(matches_.end(), found.matches.begin(), found.matches.end());
      }
    }
    options_.max_chi2 = options_.max_depth_chi2 = 1e3;
  }

  KeyframeStore store_;
  Window m_, c_;
  WindowPair windows_{m_, c_};
  Rigid3 T_m_c_;
  std::vector<PointMatch> matches_;
  JointBaOptions options_;
};

}  // namespace pangea
