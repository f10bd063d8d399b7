#include "posegraph/publication/refinements.h"

#include <gtest/gtest.h>

#include "posegraph/graph/test_rows.h"

namespace pangea {
namespace {

// A refinement of whole rows: positions stretched by two, and everything displaced.
MapState Stretched(const std::vector<int>& agents, int64_t revision) {
  MapState refined;
  refined.revision = revision;
  for (const int agent : agents) {
    refined.maps.push_back(RowId(agent));
    for (int seq = 0; seq < 3; ++seq) {
      Rigid3 pose = InARow(RowId(agent), seq).T_odom_body;
      pose.t = 2 * pose.t + Eigen::Vector3d(0, 0, 50);
      refined.keyframes.push_back({{RowId(agent), seq}, 0, pose});
    }
  }
  return refined;
}

TEST(Refinements, ANewerOneOfTheSameMapsIsUsed) {
  const GraphMaps maps = MakeRows(2, 3);
  Refinements refinements;
  EXPECT_FALSE(refinements.Add(Stretched({1, 3}, 9), maps));  // nobody knows the second map
  EXPECT_TRUE(refinements.Add(Stretched({1}, 5), maps));
  EXPECT_FALSE(refinements.Add(Stretched({1}, 5), maps));
  EXPECT_FALSE(refinements.Add(Stretched({1, 2}, 4), maps));
  EXPECT_TRUE(refinements.Add(Stretched({2}, 4), maps));
  EXPECT_TRUE(refinements.Add(Stretched({1, 2}, 6), maps));
  EXPECT_FALSE(refinements.Add(Stretched({2}, 5), maps));
}

TEST(Refinements, AreLaidOnTheSolutionWhereTheirMapsAreOneGroup) {
  const GraphMaps maps = MakeRows(2, 3);
  Refinements refinements;
  ASSERT_TRUE(refinements.Add(Stretched({2}, 4), maps));  // of one map, until the next comes
  ASSERT_TRUE(refinements.Add(Stretched({1, 2}, 5), maps));
  const auto together = refinements.Refine({0, 1}, maps);
  for (const int number : {0, 1}) {
    for (int node = 0; node < 3; ++node) {
      // About the middle, at x = 1.
      const Eigen::Vector3d p(2.0 * node - 1, 0, 0);
      EXPECT_LT((together.at(number).T_map_body(node).t - p).norm(), 1e-9);
    }
  }
  const auto apart = refinements.Refine({1}, maps);
  ASSERT_EQ(apart.size(), 1u);
  EXPECT_LT((apart.at(1).T_map_body(2).t - Eigen::Vector3d(2, 0, 0)).norm(), 1e-12);
}

// The positions of an agent that stands still show no yaw: the noise of both is all they show.
TEST(Refinements, OfAnAgentThatStandsStillKeepsItsYaw) {
  GraphMaps maps;
  maps.Add(RowId(1));
  MapState refined = Stretched({1}, 4);
  for (int seq = 0; seq < 3; ++seq) {
    Keyframe keyframe = InARow(RowId(1), seq);
    keyframe.T_odom_body.t *= 0.01;
    maps[0].Add(keyframe);
    refined.keyframes[seq].T_map_body.t = {0, -keyframe.T_odom_body.t.x(), 0};
  }
  Refinements refinements;
  ASSERT_TRUE(refinements.Add(refined, maps));
  const auto told = refinements.Refine({0}, maps);
  EXPECT_LT(LogSo3(told.at(0).T_map_body(0).q).norm(), 0.01);
}

// Whoever made it: a bundle adjustment may be another program.
TEST(Refinements, AKeyframeOfAMapThatItDoesNotNameIsLeftOut) {
  const GraphMaps maps = MakeRows(2, 3);
  MapState refined = Stretched({1, 2}, 4);
  refined.maps = {RowId(1)};
  Refinements refinements;
  ASSERT_TRUE(refinements.Add(refined, maps));
  const auto alone = refinements.Refine({0}, maps);
  EXPECT_LT((alone.at(0).T_map_body(2).t - Eigen::Vector3d(3, 0, 0)).norm(), 1e-9);
  refined.maps.clear();
  EXPECT_FALSE(refinements.Add(refined, maps)) << "of no map";
}

}  // namespace
}  // namespace pangea
