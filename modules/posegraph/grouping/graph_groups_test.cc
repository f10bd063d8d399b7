#include "posegraph/grouping/graph_groups.h"

#include <gtest/gtest.h>

#include "posegraph/graph/test_rows.h"

namespace pangea {
namespace {

using Numbers = std::vector<int>;

struct FourMaps {
  FourMaps() {
    for (int number = 0; number < 4; ++number) {
      groups.AddMap();
    }
  }
  void Merge(int a, int b) {
    pairs.Add(DerivedLoopBetween({a, 0}, {b, 0}, {}, maps), maps);
    groups.Regroup(pairs);
  }

  GraphMaps maps = MakeRows(4, 1);
  MapPairs pairs{{}};
  GraphGroups groups;
};

TEST(GraphGroups, ANewMapIsOneByItself) {
  FourMaps four;
  EXPECT_EQ(four.groups.by_oldest().size(), 4u);
  EXPECT_EQ(four.groups.num_maps(), 4u);
  EXPECT_EQ(four.groups.Of(2).maps, Numbers{2});
  EXPECT_FALSE(four.groups.AreOne(0, 1));
}

TEST(GraphGroups, AreWhatMergesConnect) {
  FourMaps four;
  four.Merge(2, 3);
  four.Merge(3, 0);
  EXPECT_EQ(four.groups.by_oldest().size(), 2u);
  EXPECT_EQ(four.groups.Of(3).maps, (Numbers{0, 2, 3}));
  EXPECT_EQ(four.groups.Of(3).oldest(), 0);
  EXPECT_TRUE(four.groups.AreOne(0, 2));
  EXPECT_EQ(four.groups.Of(1).maps, Numbers{1});
}

TEST(GraphGroups, OnlyAGroupOfOtherMapsIsSolvedAndPublishedAnew) {
  FourMaps four;
  four.Merge(0, 1);
  for (auto& [oldest, group] : four.groups.by_oldest()) {
    group.solve.Solved();
    group.solve.stale = false;
    group.solve.whole_loops = 10 + oldest;
    group.publication.Published();
    group.odometry_variance = 3;
  }
  four.Merge(2, 3);
  const GraphGroup& same = four.groups.Of(0);
  EXPECT_FALSE(same.solve.NewMapsWait() || same.publication.now);
  EXPECT_EQ(same.odometry_variance, 3);
  const GraphGroup& other = four.groups.Of(3);
  EXPECT_TRUE(other.solve.NewMapsWait() && other.publication.now);
  EXPECT_EQ(other.solve.whole_loops, 12);
  EXPECT_EQ(other.odometry_variance, 1);
}

TEST(GraphGroups, ComeApartWhenAMergeIsUndone) {
  FourMaps four;
  four.Merge(0, 1);
  four.Merge(1, 2);
  ASSERT_EQ(four.groups.by_oldest().size(), 2u);
  ASSERT_TRUE(four.pairs.UndoMerges({0, 1}, {}));
  four.groups.Regroup(four.pairs);
  EXPECT_FALSE(four.groups.AreOne(0, 1));
  EXPECT_EQ(four.groups.Of(2).maps, (Numbers{1, 2}));
}

TEST(GraphGroups, AreTheSameAfterACheckpointOfAsManyMapsOnly) {
  FourMaps four;
  four.Merge(1, 3);
  const std::vector<uint8_t> bytes = BytesOf(four.groups);
  GraphGroups restored;
  ByteRecordReader reader(bytes);
  ASSERT_TRUE(restored.Restore(&reader, 4));
  EXPECT_TRUE(reader.at_end());
  EXPECT_EQ(BytesOf(restored), bytes);
  EXPECT_TRUE(restored.AreOne(1, 3));
  for (const size_t other : {3, 5}) {
    ByteRecordReader again(bytes);
    EXPECT_FALSE(GraphGroups().Restore(&again, other));
  }
}

}  // namespace
}  // namespace pangea
