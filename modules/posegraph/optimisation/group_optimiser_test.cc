#include "posegraph/optimisation/group_optimiser.h"

#include <gtest/gtest.h>

#include "posegraph/graph/test_rows.h"

namespace pangea {
namespace {

// Two merged maps that have not been solved yet.
struct MergedMaps {
  MergedMaps() {
    group.maps = {0, 1};
    group.solve.stale = true;
    for (const int node : {2, 4, 6}) {
      AddLoop({0, node}, {1, node}, kT_0_1);
    }
  }
  void AddLoop(NodeRef from, NodeRef to, const Pose4& T) {
    const Loop& loop = loops.Add(LoopBetween(from, to, T, maps));
    if (!loop.intra()) {
      pairs.Add(loop, maps);
    }
    group.solve.AddLoop(loop);
  }
  GroupOptimiser Optimiser() { return {options, pairs, &maps, &loops}; }
  double Off() const { return (maps[1].T_map_odom.p - kT_0_1.p).norm(); }

  PoseGraphOptions options;
  GraphMaps maps = MakeRows(2, 10);
  GraphLoops loops;
  MapPairs pairs{{}};
  GraphGroup group;
};

TEST(GroupOptimiser, SolvesNewMapsFromTheBeginning) {
  MergedMaps merged;
  merged.maps[0].Move({{7, 0, 0}, 1});  // its pose in another group
  merged.Optimiser().Solve(&merged.group, false);
  EXPECT_LT(merged.Off(), 1e-6);
  const SolveSchedule& schedule = merged.group.solve;
  EXPECT_FALSE(schedule.stale || schedule.regrouped || schedule.waiting_loops > 0);
  EXPECT_EQ(schedule.known_loops, 3);
  EXPECT_EQ(schedule.whole_loops, 3);
  EXPECT_TRUE(merged.group.publication.now);
  EXPECT_EQ(merged.maps[1].solved_with, 0);
}

// With many loops, one more loop is solved starting from the solution.
TEST(GroupOptimiser, LooksAtFewNewLoopsFromTheSolution) {
  MergedMaps merged;
  for (int node = 0; node < 9; ++node) {
    merged.AddLoop({0, node}, {1, node + 1}, kT_0_1);
  }
  merged.Optimiser().Solve(&merged.group, false);
  merged.AddLoop({0, 1}, {1, 1}, Pose4{{5, 0, 0}, 0} * kT_0_1);
  merged.Optimiser().Solve(&merged.group, false);
  EXPECT_TRUE(merged.group.solve.stale);
  EXPECT_EQ(merged.group.solve.known_loops, 12);
  EXPECT_EQ(merged.group.solve.whole_loops, 12);
  const std::vector<Loop*> loops = merged.loops.Among({0, 1});
  EXPECT_FALSE(loops[12]->on);
  EXPECT_TRUE(loops[11]->on);
  merged.Optimiser().Solve(&merged.group, true);
  EXPECT_EQ(merged.group.solve.known_loops, 13);
  EXPECT_FALSE(merged.group.solve.stale);
}

TEST(GroupOptimiser, LaysWhatJoinsBesideTheSolution) {
  MergedMaps merged;
  merged.maps[0].Move({{0, 0, 0.01}, 0});  // a pose that only a solution has
  merged.maps.Add(RowId(3));               // solved with map 1 before
  merged.maps[2].Add(InARow(RowId(3), 0));
  merged.maps[2].solved_with = 1;
  merged.group.maps = {0, 1, 2};
  const std::vector<Pose4> before = merged.maps[0].poses;
  merged.Optimiser().SolveJoined(&merged.group);
  for (size_t i = 0; i < before.size(); ++i) {
    EXPECT_EQ(merged.maps[0].poses[i].p, before[i].p);
  }
  for (const int number : {1, 2}) {
    const Pose4& joined = merged.maps[number].T_map_odom;
    EXPECT_LT((joined.p - Eigen::Vector3d(0, 0, 0.01) - kT_0_1.p).norm(), 1e-6);
  }
  EXPECT_TRUE(merged.group.solve.stale);  // the solve from the beginning is still due
  EXPECT_FALSE(merged.group.solve.NewMapsWait());
  EXPECT_EQ(merged.maps[1].solved_with, 0);
}

TEST(GroupOptimiser, APartIsLargeByTheOldestMapsKeyframes) {
  MergedMaps merged;
  merged.options.local_keyframes = 9;
  EXPECT_TRUE(merged.Optimiser().JoinsALargePart(merged.group));
  merged.options.local_keyframes = 10;
  EXPECT_FALSE(merged.Optimiser().JoinsALargePart(merged.group));
  merged.options.local_keyframes = 9;
  merged.maps[1].solved_with = 0;  // nothing joins
  EXPECT_FALSE(merged.Optimiser().JoinsALargePart(merged.group));
}

}  // namespace
}  // namespace pangea
