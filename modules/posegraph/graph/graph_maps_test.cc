#include "posegraph/graph/graph_maps.h"

#include <gtest/gtest.h>

#include "posegraph/graph/test_rows.h"

namespace pangea {
namespace {

TEST(GraphMaps, AreNumberedAsTheyWereFirstSeen) {
  GraphMaps maps;
  EXPECT_EQ(maps.Add(RowId(7)), 0);
  EXPECT_EQ(maps.Add(RowId(3)), 1);
  EXPECT_EQ(maps.Add(RowId(7)), 0);
  EXPECT_EQ(maps.size(), 2u);
  EXPECT_EQ(maps.Number(RowId(3)), 1);
  EXPECT_EQ(maps.Number(RowId(4)), std::nullopt);
  EXPECT_EQ(maps[1].solved_with, 1);  // by itself
}

TEST(GraphMaps, FindAKeyframeByItsSeq) {
  GraphMaps maps;
  maps.Add(RowId(1));
  maps.Add(RowId(2));
  EXPECT_TRUE(maps[1].Add(InARow(RowId(2), 5)));
  EXPECT_TRUE(maps[1].Add(InARow(RowId(2), 8)));
  EXPECT_FALSE(maps[1].Add(InARow(RowId(2), 8)));
  EXPECT_EQ(maps.Find({RowId(2), 8}), (NodeRef{1, 1}));
  EXPECT_EQ(maps.Find({RowId(2), 7}), std::nullopt);
  EXPECT_EQ(maps.Find({RowId(9), 8}), std::nullopt);
  EXPECT_TRUE(maps.Contains({1, 1}));
  for (const NodeRef& none : {NodeRef{0, 0}, NodeRef{1, 2}, NodeRef{2, 0}, NodeRef{-1, 0}}) {
    EXPECT_FALSE(maps.Contains(none)) << none.map << ", " << none.node;
  }
  EXPECT_EQ(maps.NumKeyframes(std::vector<int>{0, 1}), 2u);
}

TEST(GraphMap, ANewKeyframeIsPlacedByTheSolutionAndTheOdometry) {
  GraphMaps maps = MakeRows(1, 3);
  maps[0].T_map_odom = {{0, 0, 5}, EIGEN_PI / 2};
  maps[0].log_scale = std::log(2.0);
  maps[0].Add(InARow(RowId(1), 3));
  const Eigen::Vector3d p(0, 6, 5);  // 3 m, doubled, along y
  EXPECT_LT((maps[0].poses[3].p - p).norm(), 1e-12);
  EXPECT_LT((maps[0].RigidAt(3) * maps[0].chain[3].T_odom_body.t - p).norm(), 1e-12);
  EXPECT_LT((maps[0].poses[2].p - Eigen::Vector3d(2, 0, 0)).norm(), 1e-12);
  maps[0].PlaceByOdometry(2);
  EXPECT_LT((maps[0].poses[2].p - Eigen::Vector3d(0, 4, 5)).norm(), 1e-12);
  EXPECT_LT((maps[0].poses[1].p - Eigen::Vector3d(1, 0, 0)).norm(), 1e-12);
}

TEST(GraphMap, MovesAsAWhole) {
  GraphMaps maps = MakeRows(1, 3);
  maps[0].Move({{0, 0, 1}, EIGEN_PI / 2});
  EXPECT_LT((maps[0].poses[2].p - Eigen::Vector3d(0, 2, 1)).norm(), 1e-12);
  EXPECT_LT((maps[0].PoseOf(2).p - maps[0].poses[2].p).norm(), 1e-12);
}

TEST(GraphMaps, AreTheSameAfterACheckpoint) {
  GraphMaps maps = MakeRows(2, 4);
  maps[1].Move({{1, 2, 3}, 0.4});
  maps[1].newest_solved = 2;
  maps[1].covariance(1, 1) = 0.5;
  const std::vector<uint8_t> bytes = BytesOf(maps);
  GraphMaps restored;
  ByteRecordReader reader(bytes);
  ASSERT_TRUE(restored.Restore(&reader));
  EXPECT_TRUE(reader.at_end());
  EXPECT_EQ(BytesOf(restored), bytes);
  EXPECT_EQ(restored.Find({RowId(2), 3}), (NodeRef{1, 3}));
}

TEST(GraphMaps, OfWhichThereAreFewerKeyframesThanSolvedAreRefused) {
  GraphMaps maps = MakeRows(1, 4);
  maps[0].newest_solved = 4;
  GraphMaps restored;
  const std::vector<uint8_t> bytes = BytesOf(maps);
  ByteRecordReader reader(bytes);
  EXPECT_FALSE(restored.Restore(&reader));
}

}  // namespace
}  // namespace pangea
