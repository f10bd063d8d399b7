#include "viewer/image_parts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace pangea::viewer {
namespace {

// Chunk `index` of an image of 4 x 2 pixels in two chunks, pixel values 0 .. 7.
image_t Chunk(int64_t utime, int16_t index) {
  image_t chunk{};
  chunk.utime = utime;
  chunk.encoding = image_t::ENCODING_RAW8;
  chunk.width = 4;
  chunk.height = 2;
  chunk.chunk = index;
  chunk.num_chunks = 2;
  chunk.total_bytes = 8;
  chunk.offset_bytes = 4 * index;
  chunk.num_bytes = 4;
  for (int i = 0; i < 4; ++i) {
    chunk.data.push_back(static_cast<uint8_t>(4 * index + i));
  }
  return chunk;
}

TEST(ImageParts, ChunksInAnyOrderMakeAnImage) {
  ImageParts parts;
  std::string refused;
  EXPECT_FALSE(parts.Add(1, Chunk(5, 1), &refused));
  EXPECT_FALSE(parts.Add(1, Chunk(5, 1), &refused)) << "a repeat";
  EXPECT_FALSE(parts.Add(2, Chunk(5, 0), &refused)) << "another agent's";
  const auto image = parts.Add(1, Chunk(5, 0), &refused);
  ASSERT_TRUE(image);
  EXPECT_EQ(image->agent_id, 1);
  EXPECT_EQ(image->utime, 5);
  EXPECT_THAT(image->bytes, testing::ElementsAre(0, 1, 2, 3, 4, 5, 6, 7));
  EXPECT_EQ(refused, "");
}

TEST(ImageParts, OfManyThatLackAChunkTheOldestGo) {
  ImageParts parts;
  std::string refused;
  for (int64_t utime = 0; utime <= static_cast<int64_t>(ImageParts::kMaxPending); ++utime) {
    EXPECT_FALSE(parts.Add(1, Chunk(utime, 0), &refused));
  }
  EXPECT_FALSE(parts.Add(1, Chunk(0, 1), &refused));
  EXPECT_TRUE(parts.Add(1, Chunk(3, 1), &refused));
}

TEST(ImageParts, RefusesChunksThatDoNotFit) {
  const auto refused_after = [](auto change) {
    ImageParts parts;
    std::string refused;
    EXPECT_FALSE(parts.Add(1, Chunk(5, 0), &refused));
    image_t chunk = Chunk(5, 1);
    change(chunk);
    EXPECT_FALSE(parts.Add(1, chunk, &refused));
    return !refused.empty();
  };
  EXPECT_TRUE(refused_after([](image_t& c) { c.encoding = 9; }));
  EXPECT_TRUE(refused_after([](image_t& c) { c.width = -1; }));
  EXPECT_TRUE(refused_after([](image_t& c) { c.width = 1'000'000; }));
  EXPECT_TRUE(refused_after([](image_t& c) { c.chunk = 2; }));
  EXPECT_TRUE(refused_after([](image_t& c) { c.num_chunks = 3; }));
  EXPECT_TRUE(refused_after([](image_t& c) { c.offset_bytes = 5; }));
  EXPECT_TRUE(refused_after([](image_t& c) { c.offset_bytes = -1; }));
  EXPECT_TRUE(refused_after([](image_t& c) { c.total_bytes = 2'000'000'000; }));
  EXPECT_TRUE(refused_after([](image_t& c) { c.total_bytes = 9; }));
}

}  // namespace
}  // namespace pangea::viewer
