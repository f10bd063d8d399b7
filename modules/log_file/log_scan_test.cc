#include "log_file/log_scan.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <unistd.h>

#include <random>

#include "core/big_endian.h"
#include "files/disk_io.h"

namespace pangea {
namespace {

using Kind = LogPiece::Kind;

class LogScanTest : public testing::Test {
 protected:
  void SetUp() override {
    std::string path = testing::TempDir() + "log_scan_XXXXXX";
    fd = mkstemp(path.data());
    ASSERT_GE(fd, 0);
    unlink(path.c_str());
  }
  void TearDown() override { close(fd); }

  // Event i of `count`, of 200 to 300 bytes of noise.
  void Fill(int count) {
    std::mt19937 random(1);
    for (int i = 0; i < count; ++i) {
      std::vector<uint8_t> data(200 + random() % 100);
      std::generate(data.begin(), data.end(), [&] { return static_cast<uint8_t>(random()); });
      begins.push_back(static_cast<int64_t>(file.size()));
      AppendLogEvent(i, 1000 + i, "KEYFRAME_1", data, &file);
    }
    begins.push_back(static_cast<int64_t>(file.size()));
  }
  struct Read {
    std::vector<int64_t> events;  // their numbers
    std::vector<std::pair<int64_t, int64_t>> damage;
    int64_t torn = 0;
  };
  Read Scan() const {
    EXPECT_EQ(ftruncate(fd, 0), 0);
    EXPECT_TRUE(WriteFully(fd, 0, file.data(), file.size()));
    Read read;
    LogScan scan(fd);
    int64_t at = 0;
    while (const auto piece = scan.Next()) {
      EXPECT_EQ(piece->offset, at) << "pieces leave no gap";
      at = piece->end();
      if (piece->kind == Kind::kEvent) {
        read.events.push_back(piece->header.number);
        EXPECT_EQ(piece->whole.size(), static_cast<size_t>(piece->bytes));
      } else if (piece->kind == Kind::kDamage) {
        read.damage.emplace_back(piece->offset, piece->end());
      } else {
        read.torn = piece->bytes;
      }
    }
    EXPECT_EQ(at, static_cast<int64_t>(file.size()));
    return read;
  }

  int fd = -1;
  std::vector<uint8_t> file;
  std::vector<int64_t> begins;  // of each event, and where the last one ends
};

TEST_F(LogScanTest, AnEmptyFileHasNoPieces) { EXPECT_TRUE(Scan().events.empty()); }

TEST_F(LogScanTest, ReadsWholeEvents) {
  Fill(3);
  EXPECT_THAT(Scan().events, testing::ElementsAre(0, 1, 2));
}

// Flips every bit of the first three events' headers: only the event that is hit may be lost.
TEST_F(LogScanTest, AFlippedBitInAHeaderLosesItsEventAlone) {
  Fill(5);
  for (int event = 0; event < 5; ++event) {
    for (size_t bit = 0; bit < 8 * LogEventHeader::kBytes; ++bit) {
      uint8_t& byte = file[static_cast<size_t>(begins[static_cast<size_t>(event)]) + bit / 8];
      byte ^= static_cast<uint8_t>(1 << bit % 8);
      const Read read = Scan();
      byte ^= static_cast<uint8_t>(1 << bit % 8);
      std::vector<int64_t> others;
      for (int64_t i = 0; i < 5; ++i) {
        if (i != event) {
          others.push_back(i);
        }
      }
      EXPECT_THAT(read.events, testing::IsSupersetOf(others)) << event << ", bit " << bit;
    }
  }
}

TEST_F(LogScanTest, DamageReachesFromAnEventToTheNextWholeOne) {
  Fill(5);
  file[static_cast<size_t>(begins[1])] ^= 1;
  const Read read = Scan();
  EXPECT_THAT(read.events, testing::ElementsAre(0, 2, 3, 4));
  EXPECT_THAT(read.damage, testing::ElementsAre(std::pair(begins[1], begins[2])));
}

TEST_F(LogScanTest, ADamagedLengthDoesNotSwallowTheEventsBehind) {
  Fill(5);
  file[static_cast<size_t>(begins[1]) + 26] ^= 2;  // 512 bytes more
  const Read read = Scan();
  EXPECT_THAT(read.events, testing::ElementsAre(0, 2, 3, 4));
}

TEST_F(LogScanTest, DamageOverSeveralEvents) {
  Fill(6);
  std::fill(file.begin() + begins[1] + 50, file.begin() + begins[3] + 10, uint8_t{0});
  const Read read = Scan();
  EXPECT_THAT(read.events, testing::IsSupersetOf({0, 4, 5}));
  EXPECT_THAT(read.events, testing::IsSubsetOf({0, 1, 4, 5})) << "1 has its header";
}

// Truncates the log at every byte of the last event.
TEST_F(LogScanTest, ATornTailIsNoDamage) {
  Fill(3);
  const std::vector<uint8_t> whole = file;
  for (int64_t length = begins[2] + 1; length < begins[3]; ++length) {
    file.assign(whole.begin(), whole.begin() + length);
    const Read read = Scan();
    EXPECT_THAT(read.events, testing::ElementsAre(0, 1));
    EXPECT_TRUE(read.damage.empty());
    EXPECT_EQ(read.torn, length - begins[2]);
  }
}

TEST_F(LogScanTest, ATailThatHoldsAnotherMagicNumberIsDamage) {
  Fill(3);
  file[static_cast<size_t>(begins[1])] ^= 1;
  file.resize(file.size() - 5);
  const Read read = Scan();
  EXPECT_THAT(read.events, testing::ElementsAre(0));
  EXPECT_EQ(read.torn, 0);
  EXPECT_THAT(read.damage, testing::ElementsAre(std::pair(begins[1], begins[3] - 5)));
}

TEST_F(LogScanTest, WhatIsNoLogHasNoEvents) {
  const std::string text = "Notes: buy milk, call the landlord about the roof.\n";
  file.assign(text.begin(), text.end());
  const Read read = Scan();
  EXPECT_TRUE(read.events.empty());
  EXPECT_EQ(read.torn, static_cast<int64_t>(text.size()));
}

TEST_F(LogScanTest, EventsLargerThanWhatIsReadAheadAreWhole) {
  for (int i = 0; i < 3; ++i) {
    AppendLogEvent(i, i, "IMAGE_1", std::vector<uint8_t>(3 << 20, 7), &file);
  }
  EXPECT_THAT(Scan().events, testing::ElementsAre(0, 1, 2));
  file[(3 << 20) + 100] ^= 1;
  EXPECT_THAT(Scan().events, testing::IsSupersetOf({0, 2}));
}

// A page that is not mapped is read like a bad sector: the kernel says EIO.
TEST(LogScan, NamesTheByteThatTheDiskDoesNotGive) {
  const auto page = static_cast<size_t>(sysconf(_SC_PAGESIZE));
  void* const pages = mmap(nullptr, 3 * page, PROT_READ, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  ASSERT_NE(pages, MAP_FAILED);
  ASSERT_EQ(munmap(static_cast<char*>(pages) + 2 * page, page), 0);
  const int fd = open("/proc/self/mem", O_RDONLY);
  ASSERT_GE(fd, 0);
  const auto begin = reinterpret_cast<int64_t>(pages);
  const auto bad = begin + static_cast<int64_t>(2 * page);
  LogScan scan(fd, begin, begin + static_cast<int64_t>(3 * page));
  try {
    scan.Next();
    ADD_FAILURE() << "was read";
  } catch (const std::runtime_error& error) {
    EXPECT_EQ(error.what(), "Input/output error at byte " + std::to_string(bad));
  }
  close(fd);
  munmap(pages, 2 * page);
}

}  // namespace
}  // namespace pangea
