#include "link/compression.h"

#include <gtest/gtest.h>

namespace pangea {
namespace {

TEST(Compression, RoundTrip) {
  for (const size_t size : {0, 1, 1000, 60'000}) {
    std::vector<uint8_t> data(size);
    for (size_t i = 0; i < size; ++i) {
      data[i] = static_cast<uint8_t>(i * i / 7);
    }
    EXPECT_EQ(Decompress(Compress(data), size), data);
  }
}

TEST(Compression, RefusesWhatIsTooLargeOrDamaged) {
  const std::vector<uint8_t> compressed = Compress(std::vector<uint8_t>(10'000, 5));
  EXPECT_TRUE(Decompress(compressed, 10'000));
  EXPECT_FALSE(Decompress(compressed, 9'999));
  EXPECT_FALSE(Decompress(Bytes(compressed).first(compressed.size() - 1), 10'000));
  EXPECT_FALSE(Decompress(std::vector<uint8_t>{1, 2, 3}, 10'000));
  EXPECT_FALSE(Decompress({}, 10'000));
}

}  // namespace
}  // namespace pangea
