#pragma once

// Two agents that walk through a test room, and the verification of a candidate between them.

#include <string>

#include "loop_verification/aligner.h"
#include "loop_verification/loop_verification_test_world.h"

namespace pangea {

inline Constraint Align(const TestAgent& query_agent, int query, const TestAgent& match_agent,
                        int match, const PlaceCandidate& candidate,
                        const LoopVerificationOptions& options = {},
                        LoopVerificationReport* report = nullptr) {
  KeyframeStore store;
  for (const TestAgent* agent : {&query_agent, &match_agent}) {
    for (const Keyframe& keyframe : agent->keyframes) {
      store.Add(keyframe);
    }
  }
  return Aligner(options).Align(
      {store.WindowUpTo(match_agent.keyframes[match].id, Aligner::kNumKeyframes),
       store.WindowUpTo(query_agent.keyframes[query].id, Aligner::kNumKeyframes),
       {}},
      candidate, std::nullopt, report);
}

// Options with which windows hold only landmarks with a depth from the odometry.
inline LoopVerificationOptions OnlyTracked() {
  LoopVerificationOptions options;
  options.window.triangulation.few_landmarks = -1;
  return options;
}

inline TestAgentOptions SecondAgent(int run) {
  TestAgentOptions options;
  options.map = {2, 2000 + run};
  options.radius = 2.3;
  options.start_angle = 0.15;
  options.height = 1.9;
  options.look_outward = 0.7;
  options.num_keyframes = 12;
  return options;
}

inline TestAgentOptions FirstAgent(int run) {
  TestAgentOptions options;
  options.map = {1, 1000 + run};
  options.num_keyframes = 12;
  return options;
}

}  // namespace pangea
