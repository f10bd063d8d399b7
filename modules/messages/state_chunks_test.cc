#include "messages/state_chunks.h"

#include <gtest/gtest.h>

namespace pangea {
namespace {

MapState Part(int64_t revision, int32_t seq) {
  MapState part;
  part.group = {1, 10};
  part.revision = revision;
  part.maps = {{1, 10}};
  part.keyframes = {{{{1, 10}, seq}, 1000 + seq, {}}};
  return part;
}

TEST(StateChunks, OneChunkIsWholeAtOnce) {
  StateChunks chunks;
  const auto whole = chunks.Add(0, 1, Part(1, 0));
  ASSERT_TRUE(whole.has_value());
  EXPECT_EQ(whole->keyframes.size(), 1u);
  EXPECT_EQ(chunks.pending(), 0u);
}

TEST(StateChunks, ChunksComeInAnyOrderAndTwice) {
  StateChunks chunks;
  EXPECT_FALSE(chunks.Add(2, 3, Part(7, 2)).has_value());
  EXPECT_FALSE(chunks.Add(0, 3, Part(7, 0)).has_value());
  EXPECT_FALSE(chunks.Add(0, 3, Part(7, 0)).has_value());
  EXPECT_FALSE(chunks.Add(0, 2, Part(8, 0)).has_value());
  const auto whole = chunks.Add(1, 3, Part(7, 1));
  ASSERT_TRUE(whole.has_value());
  ASSERT_EQ(whole->keyframes.size(), 3u);
  for (int32_t seq = 0; seq < 3; ++seq) {
    EXPECT_EQ(whole->keyframes[seq].id.seq, seq);
  }
  EXPECT_EQ(chunks.pending(), 1u);
}

TEST(StateChunks, StatesThatNeverGetWholeAreForgotten) {
  StateChunks chunks;
  for (int64_t revision = 1; revision < 1000; ++revision) {
    EXPECT_FALSE(chunks.Add(0, 2, Part(revision, 0)).has_value());
  }
  EXPECT_EQ(chunks.pending(), StateChunks::kMaxPending);
  EXPECT_TRUE(chunks.Add(1, 2, Part(999, 1)).has_value());
}

TEST(StateChunks, StatesOfMoreChunksThanFitAreForgotten) {
  StateChunks chunks;
  for (int i = 0; i < 6 * 1999; ++i) {
    EXPECT_FALSE(chunks.Add(i % 1999, 2000, Part(1 + i / 1999, i)).has_value());
  }
  EXPECT_EQ(chunks.pending(), StateChunks::kMaxChunks / 1999);
}

}  // namespace
}  // namespace pangea
