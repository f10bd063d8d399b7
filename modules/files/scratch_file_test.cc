#include "files/scratch_file.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <stdexcept>
#include <vector>

#include "files/testing/full_disk.h"

namespace pangea {
namespace {

namespace fs = std::filesystem;
using Bytes = std::vector<uint8_t>;

Bytes ReadBack(ScratchFile& file, int64_t offset, size_t size) {
  Bytes bytes(size);
  EXPECT_TRUE(file.Read(offset, bytes)) << file.problem();
  return bytes;
}

TEST(ScratchFile, GivesBackWhatWasAppendedAndLeavesNoName) {
  const fs::path folder = fs::path(testing::TempDir()) / "scratch_file_test";
  fs::create_directories(folder);
  ScratchFile file({.folder = folder});
  const Bytes a{1, 2, 3}, b{4, 5};
  const auto at_a = file.Append(a), at_b = file.Append(b);
  ASSERT_TRUE(at_a && at_b);
  EXPECT_EQ(ReadBack(file, *at_b, 2), b);
  EXPECT_EQ(ReadBack(file, *at_a, 3), a);
  EXPECT_TRUE(fs::is_empty(folder));
  EXPECT_TRUE(file.problem().empty());
}

TEST(ScratchFile, PastItsEndIsNothingToRead) {
  ScratchFile file({.folder = testing::TempDir()});
  const auto at = file.Append(Bytes{1, 2, 3});
  ASSERT_TRUE(at);
  Bytes bytes(4);
  EXPECT_FALSE(file.Read(*at, bytes));
  EXPECT_FALSE(file.Read(int64_t{1} << 62, bytes));
  EXPECT_FALSE(file.Read(-5, bytes));
  EXPECT_NE(file.problem().find("cannot be read"), std::string::npos);
}

TEST(ScratchFile, TakesNoMoreThanItMay) {
  ScratchFile file({.folder = testing::TempDir(), .max_bytes = 4});
  const auto at = file.Append(Bytes{1, 2, 3});
  ASSERT_TRUE(at);
  EXPECT_FALSE(file.Append(Bytes{4, 5}));
  EXPECT_NE(file.problem().find("holds all"), std::string::npos);
  EXPECT_EQ(file.Append(Bytes{6}), 3);
  EXPECT_EQ(ReadBack(file, *at, 4), (Bytes{1, 2, 3, 6}));
}

// A disk that is full for a while: earlier records stay readable, and later ones can be written.
TEST(ScratchFile, SaysWhyItCannotWriteAndTriesAgain) {
  ScratchFile file({.folder = testing::TempDir()});
  const auto at = file.Append(Bytes(1000, 7));
  ASSERT_TRUE(at);
  {
    const FullDisk full(1500);
    EXPECT_FALSE(file.Append(Bytes(1000, 8))) << "half of it would fit";
  }
  EXPECT_NE(file.problem().find("cannot be written: File too large"), std::string::npos)
      << file.problem();
  const auto later = file.Append(Bytes(1000, 9));
  ASSERT_TRUE(later);
  EXPECT_EQ(ReadBack(file, *at, 1000), Bytes(1000, 7));
  EXPECT_EQ(ReadBack(file, *later, 1000), Bytes(1000, 9));
}

TEST(ScratchFile, AFolderThatIsNotThereIsNamed) {
  try {
    ScratchFile file({.folder = "/nowhere/at/all"});
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("/nowhere/at/all"), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("TMPDIR"), std::string::npos);
  }
}

}  // namespace
}  // namespace pangea
