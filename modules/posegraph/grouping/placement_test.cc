#include "posegraph/grouping/placement.h"

#include <gtest/gtest.h>

#include "posegraph/graph/test_rows.h"

namespace pangea {
namespace {

const Pose4 kT_1_2{{0, 5, 1}, -1};

void ExpectNear(const Pose4& a, const Pose4& b) {
  EXPECT_LT((a.p - b.p).norm(), 1e-6);
  EXPECT_NEAR(WrapAngle(a.yaw - b.yaw), 0, 1e-6);
}

struct ThreeMaps {
  ThreeMaps() { group.maps = {0, 1, 2}; }
  void Merge(int a, int b, const Pose4& T_a_b, int num_viewpoints) {
    for (int i = 0; i < num_viewpoints; ++i) {
      pairs.Add(LoopBetween({a, 2 * i}, {b, 2 * i}, T_a_b, maps), maps);
    }
  }

  GraphMaps maps = MakeRows(3, 12);
  MapPairs pairs{{}};
  GraphGroup group;
};

TEST(PlaceMaps, OneAfterTheOtherAlongMerges) {
  ThreeMaps three;
  three.Merge(0, 1, kT_0_1, 3);
  three.Merge(1, 2, kT_1_2, 3);
  three.maps[2].log_scale = 0.1;
  three.maps[2].newest_solved = 4;
  PlaceMaps(three.group, three.pairs, &three.maps);
  ExpectNear(three.maps[0].T_map_odom, {});
  ExpectNear(three.maps[1].T_map_odom, kT_0_1);
  ExpectNear(three.maps[2].T_map_odom, kT_0_1 * kT_1_2);
  ExpectNear(three.maps[2].poses[3], kT_0_1 * kT_1_2 * Pose4{{3, 0, 0}, 0});
  EXPECT_EQ(three.maps[2].newest_solved, -1);
}

TEST(PlaceMaps, AlongTheMergeWithMostViewpoints) {
  ThreeMaps three;
  const Pose4 T_0_2{{9, 9, 0}, 0.1};
  three.Merge(0, 1, kT_0_1, 4);
  three.Merge(1, 2, kT_1_2, 3);
  three.Merge(0, 2, T_0_2, 5);
  PlaceMaps(three.group, three.pairs, &three.maps);
  ExpectNear(three.maps[1].T_map_odom, kT_0_1);
  ExpectNear(three.maps[2].T_map_odom, T_0_2);
}

TEST(PlaceParts, WhatWasSolvedTogetherMovesAsOne) {
  ThreeMaps three;
  three.Merge(0, 1, kT_0_1, 3);
  const Pose4 T_1_2_solved{{4, 4, 4}, 1};
  three.maps[2].solved_with = 1;
  three.maps[2].Move(T_1_2_solved);
  const GroupParts parts = PartsOf(three.group, three.maps);
  EXPECT_EQ(parts, (GroupParts{{0, {0}}, {1, {1, 2}}}));
  PlaceParts(three.group, {0}, parts, three.pairs, &three.maps);
  ExpectNear(three.maps[0].T_map_odom, {});
  ExpectNear(three.maps[1].T_map_odom, kT_0_1);
  ExpectNear(three.maps[2].T_map_odom, kT_0_1 * T_1_2_solved);
  ExpectNear(three.maps[2].poses[5], kT_0_1 * T_1_2_solved * Pose4{{5, 0, 0}, 0});
}

}  // namespace
}  // namespace pangea
