#include "common/alignment/aligner.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <iostream>
#include <map>

#include "common/alignment/alignment_test_world.h"

namespace pangea {
namespace {

const AlignmentGate kNoGate = [](const Rigid3&) { return std::string(); };

Constraint Align(const TestAgent& query_agent, int query, const TestAgent& match_agent, int match,
                 const PlaceCandidate& candidate, const AlignmentOptions& options = {}) {
  SubmapStore store;
  for (const TestAgent* agent : {&query_agent, &match_agent}) {
    for (const Keyframe& keyframe : agent->keyframes) {
      store.Add(keyframe);
    }
  }
  return Aligner(options).Align(
      store.WindowUpTo(match_agent.keyframes[match].id, options.window.num_keyframes),
      store.WindowUpTo(query_agent.keyframes[query].id, options.window.num_keyframes), candidate,
      kNoGate);
}

TestAgentOptions SecondAgent(int run) {
  TestAgentOptions options;
  options.map = {2, 2000 + run};
  options.radius = 2.3;
  options.start_angle = 0.15;
  options.height = 1.9;
  options.look_outward = 0.7;
  options.num_keyframes = 12;
  return options;
}

TestAgentOptions FirstAgent(int run) {
  TestAgentOptions options;
  options.map = {1, 1000 + run};
  options.num_keyframes = 12;
  return options;
}

// The estimate's covariance must be what its errors are: over many worlds the normalised error
// squared of 6 degrees of freedom has mean 6. Half to twice that is asked for: the scale each
// window is allowed, which this world does not use, makes it a little small.
TEST(AlignerTest, ErrorsAreWhatTheCovarianceSays) {
  double nees = 0, error_m = 0;
  int accepted = 0;
  constexpr int kRuns = 40;
  std::map<std::string, int> reasons;
  for (int run = 0; run < kRuns; ++run) {
    const auto room = MakeTestRoom({.seed = 100u + run});
    const TestAgent m = RunTestAgent(room, FirstAgent(run));
    const TestAgent c = RunTestAgent(room, SecondAgent(run));
    const Constraint constraint = Align(c, 9, m, 10, MakeTestCandidate(c, 9, m, 10, 40, 15));
    ++reasons[constraint.reason];
    if (!constraint.accepted) {
      continue;
    }
    ++accepted;
    const Rigid3 truth = m.T_room_body[10].Inverse() * c.T_room_body[9];
    const Vector6d error = constraint.T_from_to.Minus(truth);
    nees += error.dot(constraint.covariance.ldlt().solve(error));
    error_m += error.head<3>().norm();
  }
  for (const auto& [reason, count] : reasons) {
    std::cout << reason << ": " << count << "\n";
  }
  std::cout << "accepted " << accepted << " NEES " << nees / accepted << " error "
            << error_m / accepted << " m\n";
  EXPECT_GE(accepted, kRuns * 9 / 10);
  EXPECT_GT(nees / accepted, 3.0);
  EXPECT_LT(nees / accepted, 12.0);
  EXPECT_LT(error_m / accepted, 0.04);
}

}  // namespace
}  // namespace pangea
