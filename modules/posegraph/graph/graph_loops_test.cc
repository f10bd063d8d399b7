#include "posegraph/graph/graph_loops.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "posegraph/graph/test_rows.h"

namespace pangea {
namespace {

std::vector<int64_t> IdsOf(const std::vector<const Loop*>& loops) {
  std::vector<int64_t> ids;
  std::ranges::transform(loops, std::back_inserter(ids), [](const Loop* loop) { return loop->id; });
  return ids;
}

TEST(GraphLoops, AreFoundInTheOrderTheyCameWhereBothEndsAreMeant) {
  const GraphMaps maps = MakeRows(3, 4);
  GraphLoops loops;
  const int64_t later_map_first = loops.Add(LoopBetween({2, 0}, {0, 0}, {}, maps)).id;
  loops.Add(LoopBetween({0, 1}, {1, 1}, {}, maps));
  const int64_t within = loops.Add(LoopBetween({0, 0}, {0, 3}, {}, maps)).id;
  const int64_t back = loops.Add(LoopBetween({0, 2}, {2, 3}, {}, maps)).id;
  const GraphLoops& all = loops;
  EXPECT_EQ(IdsOf(all.Among({0, 2})), (std::vector<int64_t>{later_map_first, within, back}));
  EXPECT_TRUE(all.Among({1}).empty());
  EXPECT_EQ(all.size(), 4u);
}

TEST(MakeLoop, HasTheConstraintInTheOdomAxesOfItsFirstKeyframe) {
  GraphMaps maps = MakeRows(2, 1);
  Keyframe tilted = InARow(RowId(1), 1);
  tilted.T_odom_body.q = YawRotation(EIGEN_PI / 2);
  maps[0].Add(tilted);
  Constraint constraint = MakeConstraint({RowId(1), 1}, {RowId(2), 0}, {});
  constraint.kind = PlaceKind::kDerived;
  constraint.T_from_to = {YawRotation(-EIGEN_PI / 2), {1, 0, 0}};
  const Loop loop = MakeLoop(constraint, {0, 1}, {1, 0}, maps);
  EXPECT_EQ(loop.id, constraint.Id());
  EXPECT_TRUE(loop.sufficient);
  EXPECT_FALSE(loop.intra());
  EXPECT_EQ(loop.num_inliers, 60);
  EXPECT_LT((loop.relative.t - Eigen::Vector3d(0, 1, 0)).norm(), 1e-12);
  EXPECT_NEAR(loop.relative.yaw, 0, 1e-12);
}

TEST(GraphLoops, AreTheSameAfterACheckpointOfTheSameMapsOnly) {
  const GraphMaps maps = MakeRows(2, 4);
  GraphLoops loops;
  Loop loop = LoopBetween({0, 1}, {1, 3}, {{0, 0, 1}, 0.2}, maps);
  loop.on = false;
  loops.Add(loop);
  const std::vector<uint8_t> bytes = BytesOf(loops);
  GraphLoops restored;
  ByteRecordReader reader(bytes);
  ASSERT_TRUE(restored.Restore(&reader, maps));
  EXPECT_TRUE(reader.at_end());
  EXPECT_EQ(BytesOf(restored), bytes);
  EXPECT_EQ(restored.Among({0, 1}).size(), 1u);

  ByteRecordReader again(bytes);
  EXPECT_FALSE(GraphLoops().Restore(&again, MakeRows(2, 3)));
}

}  // namespace
}  // namespace pangea
