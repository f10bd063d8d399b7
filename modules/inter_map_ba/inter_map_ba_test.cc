#include "loop_verification/loop_verifier.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <numbers>

#include "loop_verification/loop_verification_test_world.h"

namespace pangea {
namespace {

constexpr int kRound = 68;  // keyframes of one round through the room

// One round through the room and a little further: keyframe kRound + k is at the place of keyframe
// k.
TestAgent RoundTrip(uint64_t seed, double edge_sigma_m) {
  TestAgentOptions walk;
  walk.map = {1, static_cast<int64_t>(seed)};
  walk.num_keyframes = kRound + 14;
  walk.step_angle = 2 * std::numbers::pi / kRound;
  walk.edge_sigma_m = edge_sigma_m;
  return RunTestAgent(MakeTestRoom({.seed = seed}), walk);
}

Constraint Verify(const LoopVerifierOptions& options, const TestAgent& agent, int query,
                  int match) {
  LoopVerifier verifier(options);
  for (const Keyframe& keyframe : agent.keyframes) {
    verifier.Add(keyframe);
  }
  const KeyframeId id = agent.keyframes[query].id;
  const PlaceCandidate candidate = MakeTestCandidateByDescriptor(agent, query, agent, match);
  EXPECT_TRUE(verifier.Ready(id, candidate));
  return verifier.Verify(id, candidate);
}

TEST(InterMapBa, ClosesALoopBetterThanOdometry) {
  double nees = 0;
  constexpr int kRuns = 5;
  for (int run = 0; run < kRuns; ++run) {
    const TestAgent agent = RoundTrip(20 + run, 0.01);
    const Constraint loop = Verify({}, agent, kRound + 10, 11);
    ASSERT_TRUE(loop.accepted) << loop.reason;
    EXPECT_EQ(loop.kind, PlaceKind::kIntra);
    const Rigid3 truth = agent.T_room_body[11].Inverse() * agent.T_room_body[kRound + 10];
    const Rigid3 odometry =
        agent.keyframes[11].T_odom_body.Inverse() * agent.keyframes[kRound + 10].T_odom_body;
    const Vector6d error = loop.T_from_to.Minus(truth);
    nees += error.dot(loop.covariance.ldlt().solve(error)) / kRuns;
    EXPECT_LT(error.head<3>().norm(), 0.5 * odometry.Minus(truth).head<3>().norm());
  }
  EXPECT_LT(nees, 18);  // 30 degrees of freedom in all: mean 6, three sigma above 10
}

TEST(InterMapBa, RefusesMoreDriftThanOdometryMakes) {
  LoopVerifierOptions options;
  options.drift.max_drift_m = options.drift.max_drift_share = 0;
  const Constraint loop = Verify(options, RoundTrip(30, 0.01), kRound + 10, 11);
  EXPECT_FALSE(loop.accepted);
  EXPECT_EQ(loop.reason, "more drift than odometry makes");
}

TEST(InterMapBa, RefusesNeighbours) {
  const Constraint loop = Verify({}, RoundTrip(31, 0.01), 20, 14);
  EXPECT_FALSE(loop.accepted);
  EXPECT_EQ(loop.reason, "the two keyframes are neighbours");
}

TEST(InterMapBa, IsReadyOnlyWithTheWholeWay) {
  const TestAgent agent = RoundTrip(32, 0.01);
  LoopVerifier verifier(LoopVerifierOptions{});
  const PlaceCandidate candidate{agent.keyframes[11].id, PlaceKind::kIntra, 0.5f, {}};
  const KeyframeId query = agent.keyframes[kRound + 10].id;
  for (const Keyframe& keyframe : agent.keyframes) {
    if (keyframe.id.seq != 40) {
      verifier.Add(keyframe);
    }
  }
  EXPECT_FALSE(verifier.Ready(query, candidate));
  verifier.Add(agent.keyframes[40]);
  EXPECT_TRUE(verifier.Ready(query, candidate));
}

}  // namespace
}  // namespace pangea
