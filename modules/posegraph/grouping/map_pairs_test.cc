#include "posegraph/grouping/map_pairs.h"

#include <gtest/gtest.h>

#include "posegraph/graph/test_rows.h"

namespace pangea {
namespace {

// Merges maps 0 and 1 by three viewpoints.
std::vector<Loop> MergingLoops(const GraphMaps& maps) {
  std::vector<Loop> loops;
  for (const int node : {0, 2, 4}) {
    loops.push_back(LoopBetween({0, node}, {1, node}, kT_0_1, maps));
  }
  return loops;
}

std::vector<const Loop*> Pointers(const std::vector<Loop>& loops) {
  std::vector<const Loop*> pointers;
  for (const Loop& loop : loops) {
    pointers.push_back(&loop);
  }
  return pointers;
}

TEST(MapPairs, AddSaysWhenItMerges) {
  const GraphMaps maps = MakeRows(2, 6);
  MapPairs pairs({});
  const std::vector<Loop> loops = MergingLoops(maps);
  EXPECT_FALSE(pairs.Add(loops[0], maps));
  EXPECT_FALSE(pairs.Add(loops[1], maps));
  EXPECT_TRUE(pairs.Add(loops[2], maps));
  EXPECT_FALSE(pairs.Add(LoopBetween({0, 5}, {1, 5}, kT_0_1, maps), maps));
  ASSERT_EQ(pairs.All().size(), 1u);
  EXPECT_TRUE(pairs.All()[0]->merged());
}

// The first map of a pair is the one with the smaller id, whichever was seen first, and for both
// directions of a loop.
TEST(MapPairs, TheDirectionOfALoopDoesNotMatter) {
  GraphMaps maps;
  for (const int agent : {2, 1}) {
    const int number = maps.Add(RowId(agent));
    for (int seq = 0; seq < 6; ++seq) {
      maps[number].Add(InARow(RowId(agent), seq));
    }
  }
  MapPairs pairs({});
  pairs.Add(LoopBetween({0, 0}, {1, 0}, kT_0_1, maps), maps);
  pairs.Add(LoopBetween({1, 2}, {0, 2}, kT_0_1.Inverse(), maps), maps);
  EXPECT_TRUE(pairs.Add(LoopBetween({0, 4}, {1, 4}, kT_0_1, maps), maps));
  const MapPair& pair = *pairs.All().at(0);
  EXPECT_EQ(pair.a, 1);
  EXPECT_EQ(pair.b, 0);
  const Pose4 T_b_a = pair.evidence.Alignment().Inverse();
  EXPECT_LT((T_b_a.p - kT_0_1.p).norm(), 1e-6);
  EXPECT_NEAR(T_b_a.yaw, kT_0_1.yaw, 1e-6);
}

TEST(MapPairs, AmongMapsAreThoseOfWhichBothAre) {
  const GraphMaps maps = MakeRows(4, 1);
  MapPairs pairs({});
  for (const auto& [a, b] : {std::pair(0, 1), {0, 3}, {1, 2}, {2, 3}}) {
    pairs.Add(LoopBetween({a, 0}, {b, 0}, {}, maps), maps);
  }
  const std::vector<const MapPair*> among = pairs.Among({0, 1, 3});
  ASSERT_EQ(among.size(), 2u);
  EXPECT_EQ(among[0]->b, 1);
  EXPECT_EQ(among[1]->b, 3);
}

TEST(MapPairs, AMergeThatItsLoopsDoNotCarryIsUndoneUntilNewEvidence) {
  const GraphMaps maps = MakeRows(2, 6);
  MapPairs pairs({});
  std::vector<Loop> loops = MergingLoops(maps);
  for (const Loop& loop : loops) {
    pairs.Add(loop, maps);
  }
  loops[0].on = false;
  EXPECT_FALSE(pairs.UndoMerges({0, 1}, Pointers(loops)));
  loops[1].on = false;
  EXPECT_TRUE(pairs.UndoMerges({0, 1}, Pointers(loops)));
  EXPECT_FALSE(pairs.All()[0]->merged());
  EXPECT_FALSE(pairs.UndoMerges({0, 1}, Pointers(loops)));
  EXPECT_TRUE(pairs.Add(LoopBetween({0, 5}, {1, 5}, kT_0_1, maps), maps));
  EXPECT_TRUE(pairs.All()[0]->merged());

  ASSERT_TRUE(pairs.UndoMerges({0, 1}, Pointers(loops)));
  pairs.RedoMerges();
  EXPECT_TRUE(pairs.All()[0]->merged());
}

TEST(MapPairs, ADerivedLoopCarriesAMergeAlone) {
  const GraphMaps maps = MakeRows(2, 6);
  MapPairs pairs({});
  Loop derived = DerivedLoopBetween({0, 1}, {1, 2}, kT_0_1, maps);
  EXPECT_TRUE(pairs.Add(derived, maps));
  EXPECT_FALSE(pairs.UndoMerges({0, 1}, {&derived}));
  derived.on = false;
  EXPECT_TRUE(pairs.UndoMerges({0, 1}, {&derived}));
}

TEST(MapPairs, AreTheSameAfterACheckpointOfTheSameMapsOnly) {
  const GraphMaps maps = MakeRows(2, 6);
  MapPairs pairs({});
  for (const Loop& loop : MergingLoops(maps)) {
    pairs.Add(loop, maps);
  }
  ASSERT_TRUE(pairs.UndoMerges({0, 1}, {}));
  const std::vector<uint8_t> bytes = BytesOf(pairs);
  MapPairs restored({});
  ByteRecordReader reader(bytes);
  ASSERT_TRUE(restored.Restore(&reader, maps));
  EXPECT_TRUE(reader.at_end());
  EXPECT_EQ(BytesOf(restored), bytes);
  EXPECT_FALSE(restored.All().at(0)->merged());
  restored.RedoMerges();
  EXPECT_TRUE(restored.All()[0]->merged());

  ByteRecordReader again(bytes);
  EXPECT_FALSE(MapPairs({}).Restore(&again, MakeRows(1, 6)));
}

}  // namespace
}  // namespace pangea
