// Large groups: which maps a solve moves, and which stay fixed.

#include <gtest/gtest.h>

#include <algorithm>

#include "posegraph/posegraph.h"
#include "posegraph/posegraph_test_world.h"

namespace pangea {
namespace {

// Four maps in a row: each has constraints only with the previous one.
std::vector<Constraint> InARow(const SyntheticWorld& world, int count) {
  std::vector<Constraint> constraints = MakeConstraints(world, count, 0);
  std::erase_if(constraints, [](const Constraint& one) {
    return std::abs(one.from.map.agent_id - one.to.map.agent_id) > 1;
  });
  return constraints;
}

// Displacement of a map's keyframes between two states, m.
double Moved(const MapState& before, const MapState& after, const MapId& map) {
  double moved = 0;
  for (const KeyframePose& a : before.keyframes) {
    for (const KeyframePose& b : after.keyframes) {
      if (a.id.map == map && a.id == b.id) {
        moved = std::max(moved, (a.T_map_body.t - b.T_map_body.t).norm());
      }
    }
  }
  return moved;
}

PoseGraphOptions Options(int local_keyframes) {
  PoseGraphOptions options;
  options.local_keyframes = local_keyframes;
  return options;
}

struct Row {
  explicit Row(int local_keyframes)
      : world(MakeSyntheticWorld(PosesOnly(4, 60))), graph(Options(local_keyframes)) {
    AddKeyframes(world, &graph);
  }
  // The constraints with, or without, the last map; limited in number.
  std::vector<Constraint> OfTheLast(bool last, size_t count) const {
    std::vector<Constraint> constraints = InARow(world, 2000);
    std::erase_if(constraints, [&](const Constraint& one) {
      return (one.from.map == map(3) || one.to.map == map(3)) != last;
    });
    Random random(3);
    std::ranges::shuffle(constraints, random);
    constraints.resize(std::min(constraints.size(), count));
    return constraints;
  }
  const MapId& map(int agent) const { return world.agents[agent].map; }

  SyntheticWorld world;
  PoseGraph graph;
};

TEST(LocalSolve, InALargeGroupOnlyMapsNearNewLoopsMove) {
  double ate[2];
  for (const bool local : {true, false}) {
    Row row(local ? 100 : 1000);
    AddConstraints(row.OfTheLast(false, 150), &row.graph);
    const std::vector<Constraint> of_the_last = row.OfTheLast(true, 35);
    AddConstraints({of_the_last.begin(), of_the_last.end() - 5}, &row.graph);
    row.graph.Finish();
    const MapState before = row.graph.States().front();
    ASSERT_EQ(before.maps.size(), 4u);
    AddConstraints({of_the_last.end() - 5, of_the_last.end()}, &row.graph);
    row.graph.Finish();
    const MapState after = row.graph.States().front();
    EXPECT_EQ(Moved(before, after, row.map(0)) == 0, local);
    EXPECT_GT(Moved(before, after, row.map(2)), 1e-6);
    EXPECT_GT(Moved(before, after, row.map(3)), 1e-6);
    ate[local] = JointAte(row.world, after);
  }
  EXPECT_LT(ate[true], 1.1 * ate[false]);
}

TEST(LocalSolve, AMapJoinsALargeGroupThatStays) {
  for (const bool local : {true, false}) {
    Row row(local ? 100 : 1000);
    AddConstraints(row.OfTheLast(false, 150), &row.graph);
    row.graph.Finish();
    const MapState before = row.graph.States().front();
    ASSERT_EQ(before.maps.size(), 3u);
    for (const Constraint& constraint : row.OfTheLast(true, 40)) {
      Add(constraint, &row.graph);
      if (row.graph.counters().groups == 1) {
        break;
      }
    }
    const MapState after = row.graph.States().front();
    ASSERT_EQ(after.maps.size(), 4u);
    EXPECT_EQ(Moved(before, after, row.map(0)) + Moved(before, after, row.map(2)) == 0, local);
    EXPECT_LT(JointAte(row.world, after), 0.1);
  }
}

// Maps far from new loops are solved again when the group's loops have grown by a tenth.
TEST(LocalSolve, ALargeGroupIsSolvedWholeWhenItHasGrown) {
  Row row(100);
  AddConstraints(row.OfTheLast(false, 150), &row.graph);
  AddConstraints(row.OfTheLast(true, 20), &row.graph);
  row.graph.Finish();
  const MapState before = row.graph.States().front();
  ASSERT_EQ(before.maps.size(), 4u);
  // If the loops grew by a fifth, all would be weighted anew at once.
  const int more = 15 * (before.num_constraints + before.num_switched_off) / 100;
  AddConstraints(row.OfTheLast(true, 20 + more), &row.graph);
  EXPECT_EQ(Moved(before, row.graph.States().front(), row.map(0)), 0);
  row.graph.Finish();
  EXPECT_GT(Moved(before, row.graph.States().front(), row.map(0)), 0);
}

}  // namespace
}  // namespace pangea
