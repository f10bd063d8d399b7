// Maps with unobserved scale, alone and with other maps.

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>

#include "posegraph/posegraph.h"
#include "posegraph/posegraph_test_world.h"

namespace pangea {
namespace {

MapState OfMap(const MapState& state, const MapId& map) {
  MapState part = state;
  std::erase_if(part.keyframes, [&](const KeyframePose& pose) { return pose.id.map != map; });
  return part;
}

// Published size of a map, relative to its true size.
double Size(const SyntheticWorld& world, const MapState& state) {
  Eigen::Vector3d mean_told = Eigen::Vector3d::Zero(), mean_true = Eigen::Vector3d::Zero();
  const auto count = static_cast<double>(state.keyframes.size());
  for (const KeyframePose& pose : state.keyframes) {
    mean_told += pose.T_map_body.t / count;
    mean_true += world.T_hall_body(pose.id).t / count;
  }
  double told = 0, truth = 0;
  for (const KeyframePose& pose : state.keyframes) {
    told += (pose.T_map_body.t - mean_told).squaredNorm();
    truth += (world.T_hall_body(pose.id).t - mean_true).squaredNorm();
  }
  return std::sqrt(told / truth);
}

TEST(PoseGraphScale, LoopsOfALoneMapDoNotShrinkIt) {
  SyntheticWorldOptions options = PosesOnly(1, 200);
  options.edge_sigma_yaw = 0.003;
  SyntheticWorld world = MakeSyntheticWorld(options);
  const std::vector<Constraint> constraints = MakeConstraints(world, 60, 0);
  PoseGraph metric({});
  const double size = Size(world, Solve(world, constraints, &metric).states.at(0));
  EXPECT_EQ(metric.counters().not_metric, 0);
  Unscale(0, 0.5, &world.agents[0]);
  PoseGraph graph({});
  EXPECT_NEAR(Size(world, Solve(world, constraints, &graph).states.at(0)), size, 1e-4);
  EXPECT_EQ(graph.counters().not_metric, 1);
}

// For each map as the first one, which defines the map frame.
TEST(PoseGraphScale, IsFoundWhereMetricMapsOverlap) {
  for (uint64_t seed = 1; seed <= 6; ++seed) {
    SyntheticWorld world = MakeSyntheticWorld(PosesOnly(2, 120, seed));
    std::vector<Constraint> constraints = MakeConstraints(world, 80, 0, seed);
    PoseGraph all_metric({});
    const MapState before = Solve(world, constraints, &all_metric).states.at(0);
    const double log_scale = seed % 2 == 0 ? 0.1 : -0.1;
    const size_t unscaled = seed % 3 == 0 ? 0 : 1;
    const MapId& metric = world.agents[1 - unscaled].map;
    Unscale(log_scale, 0.1, &world.agents[unscaled]);
    Unscale(log_scale, world.agents[unscaled].map, &constraints);
    PoseGraph graph({});
    const PoseGraphUpdate update = Solve(world, constraints, &graph);
    ASSERT_EQ(update.states.size(), 1u) << seed;
    const MapState& state = update.states[0];
    EXPECT_EQ(state.maps.size(), 2u) << seed;
    EXPECT_EQ(state.num_switched_off, 0) << seed;
    EXPECT_NEAR(Size(world, OfMap(state, world.agents[unscaled].map)), 1, 0.01) << seed;
    // The metric map is not deformed.
    EXPECT_NEAR(Size(world, OfMap(state, metric)), Size(world, OfMap(before, metric)), 0.002);
    EXPECT_LT(JointAte(world, OfMap(state, metric)),
              1.2 * JointAte(world, OfMap(before, metric)) + 0.002);
    EXPECT_LT(JointAte(world, state), 1.2 * JointAte(world, before) + 0.01) << seed;
  }
}

// Keyframes after the last loop, and the agent's own pose at its newest keyframe.
TEST(PoseGraphScale, CorrectionHoldsWhereTheAgentIs) {
  SyntheticWorld world = MakeSyntheticWorld(PosesOnly(2, 120));
  std::vector<Constraint> constraints = BetweenMaps(MakeConstraints(world, 80, 0));
  std::erase_if(constraints, [](const Constraint& one) { return one.to.seq > 90; });
  Unscale(0.1, 0.1, &world.agents[1]);
  PoseGraph graph({});
  const PoseGraphUpdate update = Solve(world, constraints, &graph);
  const MapState newer = OfMap(update.states.at(0), world.agents[1].map);
  EXPECT_NEAR(Size(world, newer), 1, 0.01);
  const Correction& correction = update.corrections.at(1);
  ASSERT_EQ(correction.map, world.agents[1].map);
  const auto& keyframes = world.agents[1].keyframes;
  const Eigen::Vector3d at = correction.T_map_odom * keyframes[correction.seq].T_odom_body.t;
  EXPECT_LT((at - newer.keyframes[correction.seq].T_map_body.t).norm(), 1e-9);
}

// Like the test for metric maps in posegraph_test.cc, with an error of the scale that fits its
// sigma.
TEST(PoseGraphScale, RelativePosesAreAsGoodAsTheirCovariance) {
  double sum = 0, sum_scale = 0;
  constexpr int kTrials = 20;
  for (int trial = 0; trial < kTrials; ++trial) {
    SyntheticWorldOptions options = PosesOnly(2, 150, 100 + trial);
    options.edge_sigma_yaw = 0.002;
    SyntheticWorld world = MakeSyntheticWorld(options);
    std::vector<Constraint> constraints = MakeConstraints(world, 40, 0, trial);
    Random random(trial);
    const double log_scale = std::normal_distribution<double>(0, 0.1)(random);
    Unscale(log_scale, 0.1, &world.agents[1]);
    Unscale(log_scale, world.agents[1].map, &constraints);
    PoseGraph graph({});
    const PoseGraphUpdate update = Solve(world, constraints, &graph);
    ASSERT_EQ(update.states.size(), 1u);
    const double size = Size(world, OfMap(update.states[0], world.agents[1].map));
    EXPECT_NEAR(size, 1, 0.01) << trial;
    sum_scale += (size - 1) * (size - 1);
    const Vector4d error = ErrorOfNewest(world, update.corrections.at(1));
    sum += error.dot(CovarianceOfNewest(world, update.corrections[1]).ldlt().solve(error));
  }
  std::cout << "NEES " << sum / kTrials / 4 << ", scale off by " << std::sqrt(sum_scale / kTrials)
            << "\n";
  EXPECT_GT(sum / kTrials, 2);
  EXPECT_LT(sum / kTrials, 5.9);
}

TEST(PoseGraphScale, RandomWrongMatchesNeverMergeMapsOfUnknownScale) {
  SyntheticWorld world = MakeSyntheticWorld(PosesOnly(2, 100));
  for (SyntheticAgent& agent : world.agents) {
    Unscale(0, 0.3, &agent);
  }
  PoseGraph graph({});
  AddKeyframes(world, &graph);
  const std::vector<Constraint> wrong = BetweenMaps(MakeConstraints(world, 200, 1.0));
  ASSERT_GT(wrong.size(), 50u);
  for (const Constraint& constraint : wrong) {
    Add(constraint, &graph);
    EXPECT_EQ(graph.counters().groups, 2);
  }
}

}  // namespace
}  // namespace pangea
