#include "posegraph/optimisation/group_problem.h"

#include <gtest/gtest.h>

#include "posegraph/graph/test_rows.h"

namespace pangea {
namespace {

// Two maps whose loops are at their keyframes 2, 4, 6; the second lies a little off.
struct TwoMaps {
  TwoMaps() {
    group.maps = {0, 1};
    maps[1].Move(Pose4{{0.1, 0.1, 0}, 0.02} * kT_0_1);
    for (const int node : {2, 4, 6}) {
      loops.push_back(LoopBetween({0, node}, {1, node}, kT_0_1, maps));
    }
  }
  std::vector<Loop*> Loops() {
    std::vector<Loop*> pointers;
    for (Loop& loop : loops) {
      pointers.push_back(&loop);
    }
    return pointers;
  }
  // Distance of the second map from its position according to the loops.
  double Off() const { return (maps[1].T_map_odom.p - kT_0_1.p).norm(); }

  GraphMaps maps = MakeRows(2, 10);
  GraphGroup group;
  std::vector<Loop> loops;
};

TEST(GroupProblem, TheMapsLieAsTheLoopsHaveThem) {
  TwoMaps two;
  ASSERT_GT(two.Off(), 0.1);
  GroupProblem(two.group, two.Loops(), {}, {}, &two.maps).SolveGraduated();
  EXPECT_LT(two.Off(), 1e-6);
  EXPECT_EQ(two.maps[0].poses[0].p, Eigen::Vector3d::Zero());  // the map frame
  for (int number = 0; number < 2; ++number) {
    const GraphMap& map = two.maps[number];
    EXPECT_EQ(map.newest_solved, 6);
    EXPECT_GT(map.covariance(0, 0), 0);
    // After the last loop, by odometry alone.
    EXPECT_EQ(map.poses[9].p, map.PoseOf(9).p);
  }
}

TEST(GroupProblem, AFixedMapStays) {
  TwoMaps two;
  const std::vector<Pose4> before = two.maps[1].poses;
  GroupProblem(two.group, two.Loops(), {1}, {}, &two.maps).SolveGraduated();
  for (size_t i = 0; i < before.size(); ++i) {
    EXPECT_EQ(two.maps[1].poses[i].p, before[i].p);
  }
  EXPECT_EQ(two.maps[1].newest_solved, -1);
  EXPECT_EQ(two.maps[0].newest_solved, 6);
}

TEST(GroupProblem, ALoopThatContradictsTheOthersIsSwitchedOff) {
  TwoMaps two;
  two.loops.push_back(LoopBetween({0, 3}, {1, 3}, Pose4{{3, 3, 0}, 0} * kT_0_1, two.maps));
  GroupProblem(two.group, two.Loops(), {}, {}, &two.maps).SolveGraduated();
  EXPECT_TRUE(two.loops[0].on && two.loops[1].on && two.loops[2].on);
  EXPECT_FALSE(two.loops[3].on);
  EXPECT_LT(two.Off(), 1e-6);
}

TEST(GroupProblem, FromASolutionOnlySomeMayGo) {
  for (const bool may_go : {true, false}) {
    TwoMaps two;
    GroupProblem(two.group, two.Loops(), {}, {}, &two.maps).SolveGraduated();
    two.loops.push_back(LoopBetween({0, 3}, {1, 3}, Pose4{{0, 0, 0.3}, 0} * kT_0_1, two.maps));
    GroupProblem(two.group, two.Loops(), {}, {}, &two.maps)
        .SolveWarm({false, false, false, may_go});
    EXPECT_EQ(two.loops[3].on, !may_go);
  }
}

TEST(GroupProblem, InThePapersScopeTheOldestMapIsFreeFromItsFirstLoopOn) {
  PoseGraphOptions paper;
  paper.scope = PoseGraphOptions::Scope::kPaper;
  for (const bool is_paper : {true, false}) {
    TwoMaps two;
    // The loop deforms the free part of the map: its ends are nearer than in the odometry.
    two.loops.push_back(LoopBetween({0, 2}, {0, 6}, {{-0.05, 0, 0}, 0}, two.maps));
    GroupProblem(two.group, two.Loops(), {}, is_paper ? paper : PoseGraphOptions(), &two.maps)
        .SolveGraduated();
    EXPECT_EQ(two.maps[0].poses[2].p == Eigen::Vector3d(2, 0, 0), is_paper);
    EXPECT_NE(two.maps[0].poses[5].p, Eigen::Vector3d(5, 0, 0));
  }
}

// The larger the variance of the odometry, the more a loop deforms it.
TEST(GroupProblem, OdometryCountsAsMuchAsItsVarianceSays) {
  double bent[2];
  for (const int i : {0, 1}) {
    GraphMaps maps = MakeRows(1, 10);
    GraphGroup group;
    group.maps = {0};
    group.odometry_variance = i == 0 ? 1 : 10;
    Loop loop = LoopBetween({0, 0}, {0, 9}, {{-0.05, 0, 0}, 0}, maps);
    GroupProblem(group, {&loop}, {}, {}, &maps).SolveGraduated();
    bent[i] = 9 - maps[0].poses[9].p.x();
  }
  EXPECT_NEAR(bent[0], 0.05 * 9 / 10, 1e-3);
  EXPECT_NEAR(bent[1], 0.05 * 90 / 91, 1e-3);
}

TEST(GroupProblem, AnUnknownScaleIsFound) {
  TwoMaps two;
  GraphMaps maps = MakeRows(1, 10);
  maps.Add(RowId(2));
  for (int seq = 0; seq < 10; ++seq) {
    Keyframe keyframe = InARow(RowId(2), seq);
    keyframe.scale_sigma = 0.2;
    maps[1].Add(keyframe);
  }
  // The second row is a tenth longer than in its odometry.
  std::vector<Loop> loops;
  for (const int node : {0, 3, 6, 9}) {
    loops.push_back(LoopBetween({0, node}, {1, node}, {{0.1 * node, 0, 0}, 0}, maps));
  }
  two.loops = loops;
  GroupProblem(two.group, two.Loops(), {}, {}, &maps).SolveGraduated();
  EXPECT_NEAR(maps[1].scale(), 1.1, 0.01);
  EXPECT_EQ(maps[0].log_scale, 0);
}

}  // namespace
}  // namespace pangea
