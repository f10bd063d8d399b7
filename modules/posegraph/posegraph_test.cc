#include "posegraph/posegraph.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <limits>
#include <random>

#include "posegraph/posegraph_test_world.h"

namespace pangea {
namespace {

double OdometryAte(const SyntheticWorld& world, int agent) {
  MapState state;
  for (const Keyframe& keyframe : world.agents[agent].keyframes) {
    state.keyframes.push_back({keyframe.id, keyframe.utime, keyframe.T_odom_body});
  }
  return JointAte(world, state);
}

// As after a restart: the keyframes name the correction that an earlier run published.
Keyframe Corrected(const SyntheticWorld& world, int64_t revision) {
  Keyframe keyframe = world.agents[0].keyframes[0];
  keyframe.group_revision = revision;
  return keyframe;
}

// Agents ignore a revision that is not higher than the one they have.
TEST(PoseGraph, RevisionsGoOnBehindThoseOfAnEarlierRunAlsoIfTheClockWentBack) {
  const SyntheticWorld world = MakeSyntheticWorld(PosesOnly(1, 1));
  const int64_t utime = 1000;
  const auto first_after = [&](int64_t known) {
    PoseGraph graph({}, utime);
    graph.AddKeyframe(Corrected(world, known));
    return graph.Finish().states.at(0).revision;
  };
  EXPECT_EQ(first_after(999), utime);
  EXPECT_GT(first_after(5000), 5000);
  EXPECT_EQ(first_after(std::numeric_limits<int64_t>::max()), utime) << "an agent that lies";

  PoseGraph before({}, utime), restored({}, utime), replayed({});
  before.AddKeyframe(Corrected(world, 5000));
  ByteRecordWriter writer;
  before.Save(&writer);
  const std::vector<uint8_t> bytes = writer.Take();
  ByteRecordReader reader(bytes);
  ASSERT_TRUE(restored.Restore(&reader));
  EXPECT_GT(restored.Finish().states.at(0).revision, 5000);

  replayed.AddKeyframe(Corrected(world, 5000));
  EXPECT_EQ(replayed.Finish().states.at(0).revision, 1);
}

// Else its agent would keep the correction of a merge that is no more.
TEST(PoseGraph, ALoneMapThatAnEarlierRunCorrectedIsToldThatItIsAlone) {
  const SyntheticWorld world = MakeSyntheticWorld(PosesOnly(1, 1));
  PoseGraph graph({}, 1000);
  graph.AddKeyframe(Corrected(world, 5000));
  const PoseGraphUpdate update = graph.Finish();
  ASSERT_EQ(update.corrections.size(), 1u);
  EXPECT_EQ(update.corrections[0].group, world.agents[0].map);
  EXPECT_EQ(update.corrections[0].T_map_odom.t, Eigen::Vector3d(0, 0, 0));
  EXPECT_EQ(update.corrections[0].T_map_odom.q.w(), 1);
}

TEST(PoseGraph, ALoneMapIsWhereItsOdometrySays) {
  const SyntheticWorld world = MakeSyntheticWorld(PosesOnly(1, 25));
  PoseGraph graph({});
  size_t states = 0;
  for (const Keyframe& keyframe : world.agents[0].keyframes) {
    const PoseGraphUpdate update = Add(keyframe, &graph);
    EXPECT_TRUE(update.corrections.empty());
    states += update.states.size();
  }
  EXPECT_EQ(states, 2u);
  const PoseGraphUpdate last = graph.Finish();
  ASSERT_EQ(last.states.size(), 1u);
  EXPECT_EQ(last.states[0].revision, 3);
  ASSERT_EQ(last.states[0].keyframes.size(), 25u);
  EXPECT_LT(
      (last.states[0].keyframes[24].T_map_body.t - world.agents[0].keyframes[24].T_odom_body.t)
          .norm(),
      1e-12);
  EXPECT_TRUE(graph.Finish().states.empty());
}

TEST(PoseGraph, LoopsInALoneMapTakeItsDriftAway) {
  SyntheticWorldOptions options = PosesOnly(1, 300);
  options.edge_sigma_yaw = 0.003;
  const SyntheticWorld world = MakeSyntheticWorld(options);
  PoseGraph graph({});
  const PoseGraphUpdate update = Solve(world, MakeConstraints(world, 60, 0), &graph);
  ASSERT_EQ(update.states.size(), 1u);
  EXPECT_EQ(update.states[0].num_switched_off, 0);
  EXPECT_LT(JointAte(world, update.states[0]), 0.3 * OdometryAte(world, 0));
}

TEST(PoseGraph, SwitchesOffAThirdOfWrongConstraints) {
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    const SyntheticWorld world = MakeSyntheticWorld(PosesOnly(3, 120, seed));
    PoseGraph graph({});
    const std::vector<Constraint> constraints = MakeConstraints(world, 150, 0.3, seed);
    const PoseGraphUpdate update = Solve(world, constraints, &graph);
    ASSERT_EQ(update.states.size(), 1u) << seed;
    int num_false = 0;
    for (const Constraint& constraint : constraints) {
      const Rigid3 truth =
          world.T_hall_body(constraint.from).Inverse() * world.T_hall_body(constraint.to);
      num_false += (constraint.T_from_to.t - truth.t).norm() > 1 ? 1 : 0;
    }
    EXPECT_NEAR(update.states[0].num_switched_off, num_false, 2) << seed;
    EXPECT_LT(JointAte(world, update.states[0]), 0.05) << seed;
  }
}

TEST(PoseGraph, OptimisedRelativePosesAreAsGoodAsTheirCovariance) {
  double sum = 0;
  constexpr int kTrials = 20;
  for (int trial = 0; trial < kTrials; ++trial) {
    SyntheticWorldOptions options = PosesOnly(2, 150, 100 + trial);
    options.edge_sigma_yaw = 0.002;
    const SyntheticWorld world = MakeSyntheticWorld(options);
    PoseGraph graph({});
    const PoseGraphUpdate update = Solve(world, MakeConstraints(world, 40, 0, trial), &graph);
    ASSERT_EQ(update.states.size(), 1u);
    const Correction& correction = update.corrections[1];
    ASSERT_EQ(correction.map, world.agents[1].map);
    const Vector4d error = ErrorOfNewest(world, correction);
    sum += error.dot(CovarianceOfNewest(world, correction).ldlt().solve(error));
  }
  // Four degrees of freedom; the mean of 20 has a standard deviation of 0.63. Tilt errors are a
  // random walk along the edges instead of independent, hence the wider lower limit.
  EXPECT_GT(sum / kTrials, 2);
  EXPECT_LT(sum / kTrials, 5.9);
}

// An odometry that is ten times worse than its covariances: good loops must not be switched off.
TEST(PoseGraph, OverconfidentOdometryIsNotBelieved) {
  SyntheticWorldOptions options = PosesOnly(1, 300);
  options.edge_sigma_m = 0.02;
  options.edge_sigma_yaw = 0.003;
  options.claimed_sigma_scale = 0.1;
  const SyntheticWorld world = MakeSyntheticWorld(options);
  PoseGraph graph({});
  const PoseGraphUpdate update = Solve(world, MakeConstraints(world, 60, 0.1), &graph);
  EXPECT_GT(graph.counters().odometry_scale, 3);
  EXPECT_LT(graph.counters().odometry_scale, 30);
  EXPECT_LE(update.states[0].num_switched_off, 10);
  EXPECT_LT(JointAte(world, update.states[0]), 0.5 * OdometryAte(world, 0));
}

// The odometry drifts four times more than its covariances. One additional constraint, right but
// uncertain, must change neither the factor on the odometry nor which constraints are in force.
TEST(PoseGraph, OneVagueConstraintDecidesNothing) {
  SyntheticWorldOptions options = PosesOnly(2, 150);
  options.edge_sigma_m = 0.02;
  options.edge_sigma_yaw = 0.003;
  options.claimed_sigma_scale = 0.25;
  const SyntheticWorld world = MakeSyntheticWorld(options);
  std::vector<Constraint> constraints = BetweenMaps(MakeConstraints(world, 60, 0));
  double scale[2] = {};
  for (const int vague : {0, 1}) {
    if (vague == 1) {
      Constraint& middle = constraints[constraints.size() / 2];
      middle.covariance *= 1000;
    }
    PoseGraph graph({});
    const PoseGraphUpdate update = Solve(world, constraints, &graph);
    ASSERT_EQ(graph.counters().groups, 1);
    EXPECT_LE(update.states[0].num_switched_off, 3);
    scale[vague] = graph.counters().odometry_scale;
  }
  EXPECT_GT(scale[0], 1.5);
  EXPECT_LT(scale[0], 6);
  EXPECT_NEAR(scale[1] / scale[0], 1, 0.1);
}

TEST(PoseGraph, TheOrderOfArrivalDoesNotChangeTheShape) {
  const SyntheticWorld world = MakeSyntheticWorld(PosesOnly(3, 80));
  std::vector<Constraint> constraints = MakeConstraints(world, 80, 0.2);
  std::vector<std::vector<KeyframePose>> results;
  for (int order = 0; order < 3; ++order) {
    PoseGraph graph({});
    std::shuffle(constraints.begin(), constraints.end(), Random(order));
    for (size_t a = 0; a < world.agents.size(); ++a) {
      for (const Keyframe& keyframe : world.agents[(a + order) % 3].keyframes) {
        Add(keyframe, &graph);
      }
    }
    AddConstraints(constraints, &graph);
    const PoseGraphUpdate update = graph.Finish();
    const std::vector<MapState> states = graph.States();
    ASSERT_EQ(states.size(), 1u);
    EXPECT_EQ(states[0].group, world.agents[order].map);
    std::vector<KeyframePose> poses = states[0].keyframes;
    std::ranges::sort(poses, {}, &KeyframePose::id);
    const Rigid3 T_first_map = poses[0].T_map_body.Inverse();
    for (KeyframePose& pose : poses) {
      pose.T_map_body = T_first_map * pose.T_map_body;
    }
    results.push_back(poses);
  }
  for (size_t i = 0; i < results[0].size(); ++i) {
    for (int order = 1; order < 3; ++order) {
      EXPECT_LT((results[0][i].T_map_body.t - results[order][i].T_map_body.t).norm(), 2e-4);
    }
  }
}

TEST(PoseGraph, TheSameCallsGiveTheSameBytes) {
  const SyntheticWorld world = MakeSyntheticWorld(PosesOnly(2, 60));
  const std::vector<Constraint> constraints = MakeConstraints(world, 40, 0.2);
  std::vector<double> results[2];
  for (std::vector<double>& result : results) {
    PoseGraph graph({});
    const PoseGraphUpdate update = Solve(world, constraints, &graph);
    for (const KeyframePose& pose : update.states.at(0).keyframes) {
      result.push_back(pose.T_map_body.t.x());
      result.push_back(pose.T_map_body.q.z());
    }
  }
  EXPECT_EQ(results[0], results[1]);
}

TEST(PoseGraph, ConstraintsWaitForTheirKeyframes) {
  const SyntheticWorld world = MakeSyntheticWorld(PosesOnly(2, 60));
  const std::vector<Constraint> constraints = MakeConstraints(world, 20, 0);
  PoseGraph graph({});
  AddConstraints(constraints, &graph);
  AddConstraints(constraints, &graph);
  EXPECT_EQ(graph.counters().waiting, static_cast<int64_t>(constraints.size()));
  AddKeyframes(world, &graph);
  graph.Finish();
  EXPECT_EQ(graph.counters().waiting, 0);
  EXPECT_EQ(graph.counters().groups, 1);
  EXPECT_EQ(graph.counters().in_force, static_cast<int64_t>(constraints.size()));
}

TEST(PoseGraph, BridgesAGapThatNobodyFills) {
  const SyntheticWorld world = MakeSyntheticWorld(PosesOnly(2, 100));
  PoseGraph graph({});
  for (const SyntheticAgent& agent : world.agents) {
    for (const Keyframe& keyframe : agent.keyframes) {
      if (keyframe.id.seq < 40 || keyframe.id.seq >= 46) {
        Add(keyframe, &graph);
      }
    }
  }
  AddConstraints(MakeConstraints(world, 60, 0), &graph);
  const PoseGraphUpdate update = graph.Finish();
  EXPECT_EQ(graph.counters().bridged, 2);
  ASSERT_EQ(update.states.size(), 1u);
  EXPECT_LT(JointAte(world, update.states[0]), 0.06);
}

// As in the paper, the start of the main map stays at its odometry's poses.
TEST(PoseGraph, ScopeOfThePaper) {
  SyntheticWorldOptions options = PosesOnly(2, 120);
  options.start_apart = 0.3;
  options.edge_sigma_yaw = 0.003;
  const SyntheticWorld world = MakeSyntheticWorld(options);
  PoseGraphOptions paper;
  paper.scope = PoseGraphOptions::Scope::kPaper;
  PoseGraph graph(paper);
  AddKeyframes(world, &graph);
  int first_overlap = 1000;
  for (const Constraint& constraint : BetweenMaps(MakeConstraints(world, 60, 0))) {
    Add(constraint, &graph);
    first_overlap = std::min(first_overlap, constraint.from.seq);
  }
  const PoseGraphUpdate update = graph.Finish();
  ASSERT_EQ(update.states.size(), 1u);
  ASSERT_GT(first_overlap, 3);
  double head = 0, rest = 0;
  for (const KeyframePose& pose : update.states[0].keyframes) {
    if (pose.id.map == world.agents[0].map) {
      const Rigid3& T_odom_body = world.agents[0].keyframes[pose.id.seq].T_odom_body;
      double& moved = pose.id.seq <= first_overlap ? head : rest;
      moved = std::max(moved, (pose.T_map_body.t - T_odom_body.t).norm());
    }
  }
  EXPECT_LT(head, 1e-12);
  EXPECT_GT(rest, 1e-3);
}

}  // namespace
}  // namespace pangea
