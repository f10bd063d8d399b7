#include "place_recognition/descriptor_index.h"

#include <gtest/gtest.h>
#include <malloc.h>

#include <algorithm>
#include <random>

#include "place_recognition/test_world.h"

namespace pangea {
namespace {

const MapId kMap{1, 1000};

TEST(DescriptorIndex, TheSamePlaceScoresHighest) {
  test::TestWorld world(1);
  DescriptorIndex index;
  for (int i = 0; i < 12; ++i) {  // all around the room
    index.Add(world.See({kMap, i}, {0, 0, 1.5}, i * 0.5236).corners);
  }
  for (int i = 0; i < 12; ++i) {
    const auto scores =
        index.Query(world.See({kMap, 100 + i}, {0.5, 0.3, 1.6}, i * 0.5236).corners);
    const auto best = std::max_element(scores.begin(), scores.end());
    EXPECT_LE(std::abs(WrapAngle((best - scores.begin() - i) * 0.5236)), 0.53);
    EXPECT_LE(*best, 1.0f);
  }
}

// Of the network's descriptors more pairs with many different bits are found.
TEST(DescriptorIndex, TheNetworksDescriptorsAreSearchedMoreWidely) {
  test::TestWorld world(1, {.flipped_bits = 35});
  DescriptorIndex index;
  index.Add(world.See({kMap, 0}, {0, 0, 1.5}, 0).corners);
  index.Add(world.See({kMap, 1}, {0, 0, 1.5}, 2).corners);
  const auto query = world.See({kMap, 100}, {0, 0, 1.5}, 0).corners;
  const auto as_orb = index.Query(query, DescriptorKind::kOrb);
  const auto as_network = index.Query(query, DescriptorKind::kPatchNetwork);
  EXPECT_GT(as_network[0], 3 * as_orb[0]);
  EXPECT_GT(as_network[0], 10 * as_network[1]);
}

TEST(DescriptorIndex, AnotherWorldScoresNearNothing) {
  test::TestWorld world(1);
  test::TestWorld other(2);
  DescriptorIndex index;
  for (int i = 0; i < 12; ++i) {
    index.Add(world.See({kMap, i}, {0, 0, 1.5}, i * 0.5236).corners);
  }
  const auto strange = index.Query(other.See({kMap, 50}, {0, 0, 1.5}, 0).corners);
  const auto same = index.Query(world.See({kMap, 50}, {0.2, 0, 1.5}, 0).corners);
  EXPECT_LT(*std::max_element(strange.begin(), strange.end()),
            0.5f * *std::max_element(same.begin(), same.end()));
}

TEST(DescriptorIndex, EmptyIndexAndEmptyKeyframe) {
  test::TestWorld world(1);
  DescriptorIndex index;
  EXPECT_TRUE(index.Query(world.See({kMap, 0}, {0, 0, 1.5}, 0).corners).empty());
  index.Add({});
  EXPECT_EQ(index.Query(world.See({kMap, 0}, {0, 0, 1.5}, 0).corners), std::vector<float>{0.0f});
  EXPECT_EQ(index.Query(std::vector<Corner>{}), std::vector<float>{0.0f});
}

TEST(DescriptorIndex, AQueryOfFiveThousandKeyframesComparesAFewPostingsPerCorner) {
  test::TestWorld world(3, {.num_points = 100, .max_corners = 0, .clutter = 120});
  DescriptorIndex index;
  for (int i = 0; i < 5000; ++i) {
    index.Add(world.See({kMap, i}, {0, 0, 1.5}, 0).corners);
  }
  const auto corners = world.See({kMap, 6000}, {0, 0, 1.5}, 0).corners;
  // An exhaustive search would compare all 600,000.
  EXPECT_LT(index.CountPostings(corners) / static_cast<int64_t>(corners.size()), 60);
}

TEST(DescriptorIndex, IsNotRestoredWithPostingsOfAKeyframeThatItLacks) {
  test::TestWorld world(1);
  DescriptorIndex index;
  for (int i = 0; i < 3; ++i) {
    index.Add(world.See({kMap, i}, {0, 0, 1.5}, 0).corners);
  }
  ByteRecordWriter writer;
  index.Save(&writer);
  std::vector<uint8_t> bytes = writer.Take();
  ByteRecordReader whole(bytes);
  EXPECT_TRUE(DescriptorIndex().Restore(&whole));
  // The bytes begin with a count and as many numbers of corners.
  bytes[0] = 2;
  bytes.erase(bytes.begin() + 4, bytes.begin() + 8);
  ByteRecordReader one_less(bytes);
  EXPECT_FALSE(DescriptorIndex().Restore(&one_less));
}

double HeapBytes() {
  const struct mallinfo2 info = mallinfo2();
  return static_cast<double>(info.uordblks) + static_cast<double>(info.hblkhd);
}

TEST(DescriptorIndex, AKeyframeOf600CornersTakesLessThan20kB) {
  std::mt19937_64 rng(1);
  std::vector<Corner> corners(600);
  DescriptorIndex index;
  const auto add = [&](int keyframes) {
    for (int i = 0; i < keyframes; ++i) {
      for (Corner& corner : corners) {
        std::ranges::generate(corner.descriptor, rng);
      }
      index.Add(corners);
    }
  };
  // Tables are packed at different times, so some postings are still waiting.
  add(500);
  const double before = HeapBytes();
  add(1500);
  EXPECT_LT((HeapBytes() - before) / 1500, 20000);
}

}  // namespace
}  // namespace pangea
