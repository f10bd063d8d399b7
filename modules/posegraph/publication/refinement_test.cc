#include "posegraph/publication/refinement.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "core/testing/synthetic_world.h"
#include "posegraph/posegraph.h"
#include "posegraph/posegraph_test_world.h"

namespace pangea {
namespace {

using Positions = std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>>;

TEST(FitYawAndShift, FindsYawAndShift) {
  const Pose4 T{{1, -2, 3}, 2.5};
  std::mt19937_64 rng(1);
  std::normal_distribution<double> normal(0, 1);
  Positions pairs;
  for (int i = 0; i < 10; ++i) {
    const Eigen::Vector3d p(normal(rng), normal(rng), normal(rng));
    pairs.emplace_back(T * p, p);
  }
  const Pose4 found = FitYawAndShift(pairs);
  EXPECT_NEAR(WrapAngle(found.yaw - T.yaw), 0, 1e-12);
  EXPECT_LT((found.p - T.p).norm(), 1e-12);
}

TEST(FitYawAndShift, OnePairIsAShift) {
  const Pose4 found = FitYawAndShift({{{1, 2, 3}, {0, 0, 1}}});
  EXPECT_EQ(found.yaw, 0);
  EXPECT_EQ(found.p, Eigen::Vector3d(1, 2, 2));
}

// Two agents in one group, solved by the graph.
struct Server {
  Server() {
    SyntheticWorldOptions options;
    options.num_keyframes = 40;
    options.with_corners = false;
    world = MakeSyntheticWorld(options);
    for (size_t k = 0; k < world.agents[0].keyframes.size(); ++k) {
      for (const SyntheticAgent& agent : world.agents) {
        Add(agent.keyframes[k], &graph);
      }
    }
    std::mt19937_64 rng(11);
    const std::vector<OverlappingPair> pairs = OverlappingPairs(world, 1.5, 25);
    for (size_t i = 0; i < pairs.size(); i += 1 + pairs.size() / 40) {
      Add(MakeTrueConstraint(world, pairs[i].from, pairs[i].to, {}, rng), &graph);
    }
    solved = graph.Finish().states.back();
  }
  // The truth, in another frame.
  MapState Truth() const {
    MapState truth = solved;
    const Rigid3 T(YawRotation(1), {5, 6, 7});
    for (KeyframePose& pose : truth.keyframes) {
      pose.T_map_body = T * world.T_hall_body(pose.id);
    }
    return truth;
  }

  SyntheticWorld world;
  PoseGraph graph{PoseGraphOptions{}};
  MapState solved;
};

// Largest difference of the relative positions of all keyframes to the first.
double Difference(const MapState& a, const MapState& b) {
  double largest = 0;
  for (size_t i = 0; i < a.keyframes.size(); ++i) {
    const Eigen::Vector3d p_a = a.keyframes[0].T_map_body.Inverse() * a.keyframes[i].T_map_body.t;
    const Eigen::Vector3d p_b = b.keyframes[0].T_map_body.Inverse() * b.keyframes[i].T_map_body.t;
    largest = std::max(largest, (p_a - p_b).norm());
  }
  return largest;
}

TEST(Refinement, IsToldInTheFrameOfTheSolution) {
  Server server;
  ASSERT_EQ(server.solved.maps.size(), 2u);
  const MapState truth = server.Truth();
  ASSERT_GT(Difference(server.solved, truth), 0.005);
  server.graph.AddRefinement(truth);
  const PoseGraphUpdate update = server.graph.Update();
  ASSERT_EQ(update.states.size(), 1u);
  EXPECT_LT(Difference(update.states[0], truth), 1e-9);
  EXPECT_GT(update.states[0].revision, server.solved.revision);
  Eigen::Vector3d moved = Eigen::Vector3d::Zero();
  for (size_t i = 0; i < truth.keyframes.size(); ++i) {
    moved += update.states[0].keyframes[i].T_map_body.t - server.solved.keyframes[i].T_map_body.t;
  }
  EXPECT_LT(moved.norm(), 1e-6);  // on the whole it lies on the solution
  // The corrections agree with the state at the newest solved keyframe.
  ASSERT_EQ(update.corrections.size(), 2u);
  for (const Correction& correction : update.corrections) {
    const KeyframeId id{correction.map, correction.seq};
    const auto told = std::ranges::find(update.states[0].keyframes, id, &KeyframePose::id);
    const auto agent = std::ranges::find(server.world.agents, id.map, &SyntheticAgent::map);
    EXPECT_LT((correction.T_map_odom * agent->keyframes[id.seq].T_odom_body.t - told->T_map_body.t)
                  .norm(),
              1e-9);
  }
}

TEST(Refinement, OtherKeyframesKeepTheirPlaceBehindTheRefinedOneBeforeThem) {
  Server server;
  MapState truth = server.Truth();
  std::erase_if(truth.keyframes, [](const KeyframePose& pose) { return pose.id.seq >= 30; });
  server.graph.AddRefinement(truth);
  const MapState told = server.graph.Update().states.back();
  for (size_t i = 0; i < told.keyframes.size(); ++i) {
    const KeyframeId& id = told.keyframes[i].id;
    if (id.seq < 30) {
      continue;
    }
    const size_t last = i - static_cast<size_t>(id.seq - 29);
    const double told_apart =
        (told.keyframes[i].T_map_body.t - told.keyframes[last].T_map_body.t).norm();
    const double solved_apart =
        (server.solved.keyframes[i].T_map_body.t - server.solved.keyframes[last].T_map_body.t)
            .norm();
    EXPECT_NEAR(told_apart, solved_apart, 1e-9);
  }
}

TEST(Refinement, ARepeatOrAnOlderOneChangesNothing) {
  Server server;
  MapState truth = server.Truth();
  truth.revision = 100;
  server.graph.AddRefinement(truth);
  EXPECT_EQ(server.graph.Update().states.size(), 1u);
  server.graph.AddRefinement(truth);
  MapState older = server.solved;
  older.revision = 99;
  server.graph.AddRefinement(older);
  EXPECT_TRUE(server.graph.Update().states.empty());
  EXPECT_LT(Difference(server.graph.States().back(), truth), 1e-9);
}

// The graph's decisions do not depend on when a refinement comes.
TEST(Refinement, TheSolutionStaysAsItWas) {
  Server with, without;
  with.graph.AddRefinement(with.Truth());
  std::mt19937_64 rng(3);
  const auto pairs = OverlappingPairs(with.world, 1.5, 25);
  const Constraint more = MakeTrueConstraint(with.world, pairs[1].from, pairs[1].to, {}, rng);
  for (Server* server : {&with, &without}) {
    Add(more, &server->graph);
    server->graph.Finish();
  }
  EXPECT_EQ(with.graph.counters().in_force, without.graph.counters().in_force);
  MapState forget = without.solved;
  forget.revision = 1'000'000;
  forget.keyframes.clear();
  with.graph.AddRefinement(forget);
  EXPECT_LT(Difference(with.graph.States().back(), without.graph.States().back()), 1e-12);
}

TEST(Refinement, OfMapsThatAreNotOneGroupIsNotUsed) {
  SyntheticWorldOptions options;
  options.num_keyframes = 12;
  options.with_corners = false;
  const SyntheticWorld world = MakeSyntheticWorld(options);
  PoseGraph graph({});
  MapState refined;
  refined.revision = 1;
  for (const SyntheticAgent& agent : world.agents) {
    refined.maps.push_back(agent.map);
    for (const Keyframe& keyframe : agent.keyframes) {
      refined.keyframes.push_back({keyframe.id, keyframe.utime, world.T_hall_body(keyframe.id)});
    }
  }
  refined.group = refined.maps.front();
  graph.AddRefinement(refined);  // of maps that nobody knows yet
  for (const SyntheticAgent& agent : world.agents) {
    for (const Keyframe& keyframe : agent.keyframes) {
      Add(keyframe, &graph);
    }
  }
  graph.AddRefinement(refined);
  for (const MapState& state : graph.States()) {
    for (const KeyframePose& pose : state.keyframes) {
      const auto agent = std::ranges::find(world.agents, pose.id.map, &SyntheticAgent::map);
      EXPECT_LT((pose.T_map_body.t - agent->keyframes[pose.id.seq].T_odom_body.t).norm(), 1e-9);
    }
  }
}

}  // namespace
}  // namespace pangea
