#include "place_recognition/stored_keyframes.h"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

namespace pangea {
namespace {

constexpr int32_t kMax = std::numeric_limits<int32_t>::max();

std::vector<uint8_t> BytesOf(int32_t first, int32_t last, const std::vector<uint8_t>& gaps) {
  ByteRecordWriter writer;
  writer.Put(first);
  writer.Put(last);
  writer.Put(gaps);
  return writer.Take();
}

bool Restores(const std::vector<uint8_t>& bytes) {
  ByteRecordReader reader(bytes);
  return AscendingNumbers().Restore(&reader);
}

TEST(AscendingNumbers, AreRestoredAsTheyWere) {
  for (const std::vector<int32_t>& numbers : std::vector<std::vector<int32_t>>{
           {}, {5}, {0, kMax}, {3, 3, 130, 131, 20'000'000, kMax - 1}}) {
    ByteRecordWriter writer;
    AscendingNumbers(numbers).Save(&writer);
    const std::vector<uint8_t> bytes = writer.Take();
    ByteRecordReader reader(bytes);
    AscendingNumbers restored;
    ASSERT_TRUE(restored.Restore(&reader));
    for (const int32_t number : numbers) {
      EXPECT_TRUE(restored.HasOneOf({number})) << number;
    }
    EXPECT_FALSE(restored.HasOneOf({4, 129}));
  }
}

TEST(AscendingNumbers, OtherBytesAreRefused) {
  EXPECT_TRUE(Restores(BytesOf(3, 7, {4})));
  EXPECT_FALSE(Restores(BytesOf(3, 8, {4}))) << "does not end at the last one";
  EXPECT_FALSE(Restores(BytesOf(3, 7, {0x84}))) << "a gap without an end";
  EXPECT_FALSE(Restores(BytesOf(3, 7, {0x84, 0x80, 0x80, 0x80, 0x80, 0x80, 0}))) << "too long";
  EXPECT_FALSE(Restores(BytesOf(3, kMax, {0xff, 0xff, 0xff, 0xff, 0x7f}))) << "beyond 32 bits";
  EXPECT_FALSE(Restores(BytesOf(-4, 3, {7}))) << "no landmark";
  EXPECT_FALSE(Restores(BytesOf(0, -1, {1}))) << "a gap in an empty list";
  EXPECT_FALSE(Restores({1, 2, 3}));
}

// A place outside of the RecordStore would be read from memory that is not there.
TEST(StoredKeyframes, APlaceThatNoRecordHasIsRefused) {
  const auto restores = [](int64_t offset, uint32_t size) {
    ByteRecordWriter writer;
    writer.PutCount(1);
    writer.Put(KeyframeId{{1, 1000}, 0});
    writer.Put(DescriptorKind::kOrb);
    AscendingNumbers().Save(&writer);
    writer.Put(offset);
    writer.Put(size);
    const std::vector<uint8_t> bytes = writer.Take();
    ByteRecordReader reader(bytes);
    return StoredKeyframes(nullptr).Restore(&reader);
  };
  EXPECT_TRUE(restores(0, 8));
  EXPECT_FALSE(restores(-1, 8));
  EXPECT_FALSE(restores(0, std::numeric_limits<uint32_t>::max()));
}

}  // namespace
}  // namespace pangea
