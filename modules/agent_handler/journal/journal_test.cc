#include "agent_handler/journal/journal.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <lcm/lcm-cpp.hpp>

namespace pangea {
namespace {

struct Seen {
  std::string channel;
  std::vector<uint8_t> data;
  JournalPlace place;
};

class JournalTest : public testing::Test {
 protected:
  void SetUp() override {
    path = testing::TempDir() + "pangea_journal_" + std::to_string(getpid()) + ".lcm";
    std::filesystem::remove(path);
  }
  void TearDown() override { std::filesystem::remove(path); }

  std::unique_ptr<Journal> Open() {
    seen.clear();
    return std::make_unique<Journal>(
        path, [this](const std::string& channel, Bytes data, const JournalPlace& place) {
          seen.push_back({channel, {data.begin(), data.end()}, place});
          return data.empty() || data[0] != 99;
        });
  }
  static std::vector<uint8_t> Payload(int i) {
    return std::vector<uint8_t>(static_cast<size_t>(10 + 7 * i), static_cast<uint8_t>(i));
  }
  void Write(int count) {
    const auto journal = Open();
    for (int i = 0; i < count; ++i) {
      journal->Append(1000 + i, "KEYFRAME_" + std::to_string(i), Payload(i));
    }
    ASSERT_TRUE(journal->Sync());
  }

  std::string path;
  std::vector<Seen> seen;
};

TEST_F(JournalTest, AnyLcmToolReadsIt) {
  Write(5);
  lcm::LogFile log(path, "r");
  ASSERT_TRUE(log.good());
  for (int i = 0; i < 5; ++i) {
    const lcm::LogEvent* event = log.readNextEvent();
    ASSERT_NE(event, nullptr);
    EXPECT_EQ(event->eventnum, i);
    EXPECT_EQ(event->timestamp, 1000 + i);
    EXPECT_EQ(event->channel, "KEYFRAME_" + std::to_string(i));
    const auto* data = static_cast<const uint8_t*>(event->data);
    EXPECT_EQ(std::vector<uint8_t>(data, data + event->datalen), Payload(i));
  }
  EXPECT_EQ(log.readNextEvent(), nullptr);
}

TEST_F(JournalTest, ReadsBackByPlaceBeforeAndAfterSyncAndReopening) {
  {
    const auto journal = Open();
    const JournalPlace first = journal->Append(1, "A", Payload(1));
    const JournalPlace second = journal->Append(2, "B", Payload(2));
    EXPECT_EQ(journal->Read(second), Payload(2));
    ASSERT_TRUE(journal->Sync());
    EXPECT_EQ(journal->Read(first), Payload(1));
    EXPECT_EQ(journal->Read(second), Payload(2));
    EXPECT_TRUE(journal->Read({1 << 20, 10}).empty());
  }
  const auto journal = Open();
  ASSERT_EQ(seen.size(), 2u);
  EXPECT_EQ(journal->Read(seen[1].place), Payload(2));
}

// Cut at every byte: what was complete is kept, the rest is cut, and appending goes on.
TEST_F(JournalTest, TornTailIsCutAndHealed) {
  Write(3);
  const auto full = static_cast<int64_t>(std::filesystem::file_size(path));
  const auto last_begin = full - 28 - 10 - static_cast<int64_t>(Payload(2).size());
  std::filesystem::remove(path);
  for (int64_t length = last_begin; length < full; ++length) {
    Write(3);
    std::filesystem::resize_file(path, static_cast<uintmax_t>(length));
    {
      const auto journal = Open();
      EXPECT_EQ(seen.size(), 2u) << length;
      EXPECT_EQ(journal->cut_bytes(), length - last_begin);
      journal->Append(9, "AFTER", Payload(4));
    }
    Open();
    ASSERT_EQ(seen.size(), 3u);
    EXPECT_EQ(seen[2].channel, "AFTER");
    EXPECT_EQ(seen[2].data, Payload(4));
    std::filesystem::remove(path);
  }
}

TEST_F(JournalTest, DamagedContentInTheTailIsCutToo) {
  {
    const auto journal = Open();
    journal->Append(1, "A", Payload(1));
    journal->Append(2, "A", Payload(99));
  }
  EXPECT_GT(Open()->cut_bytes(), 0);
  Open();
  EXPECT_EQ(seen.size(), 1u);
}

// It cannot be a torn tail: what comes after it is not thrown away with it.
TEST_F(JournalTest, DamagedContentFarFromTheTailIsPassedOver) {
  constexpr int kAfter = 50;
  {
    const auto journal = Open();
    journal->Append(1, "A", Payload(99));
    for (int i = 0; i < kAfter; ++i) {
      journal->Append(1, "A", std::vector<uint8_t>(Journal::kMaxTornBytes / kAfter, 1));
      journal->Sync();
    }
  }
  const auto size = std::filesystem::file_size(path);
  EXPECT_EQ(Open()->cut_bytes(), 0);
  EXPECT_EQ(seen.size(), 1u + kAfter);
  EXPECT_EQ(std::filesystem::file_size(path), size);
}

TEST_F(JournalTest, DamageThatIsNoTornTailIsNotThrownAway) {
  {
    const auto journal = Open();
    for (int i = 0; i < 100; ++i) {
      journal->Append(1, "A", std::vector<uint8_t>(50'000, 1));
      journal->Sync();
    }
  }
  const auto size = std::filesystem::file_size(path);
  const int fd = open(path.c_str(), O_WRONLY);
  ASSERT_EQ(pwrite(fd, "xxxx", 4, 0), 4);
  close(fd);
  EXPECT_THROW(Open(), std::runtime_error);
  EXPECT_EQ(std::filesystem::file_size(path), size);
}

TEST_F(JournalTest, EventNumbersGoOnAfterItWasOpenedAgain) {
  Write(3);
  Write(2);
  lcm::LogFile log(path, "r");
  for (int i = 0; i < 5; ++i) {
    const lcm::LogEvent* event = log.readNextEvent();
    ASSERT_NE(event, nullptr);
    EXPECT_EQ(event->eventnum, i);
  }
}

TEST_F(JournalTest, SaysWhenItsQueueIsFull) {
  const auto journal = Open();
  const std::vector<uint8_t> payload(Journal::kMaxQueuedBytes / 4, 1);
  for (int i = 0; i < 4; ++i) {
    EXPECT_FALSE(journal->Full()) << i;
    journal->Append(i, "A", payload);
  }
  EXPECT_TRUE(journal->Full());
  EXPECT_TRUE(journal->Sync());
  EXPECT_FALSE(journal->Full());
}

TEST_F(JournalTest, IsUsedByOneProcessAtATime) {
  const auto journal = Open();
  EXPECT_THROW(Open(), std::runtime_error);
}

TEST_F(JournalTest, AFolderThatIsMissingIsNamed) {
  EXPECT_THROW(Journal("/no/such/folder/journal.lcm",
                       [](const std::string&, Bytes, const JournalPlace&) { return true; }),
               std::runtime_error);
}

// /dev/full refuses every write as a full disk does.
TEST_F(JournalTest, AFullDiskKeepsEverythingQueued) {
  const auto journal = std::make_unique<Journal>(
      "/dev/full", [](const std::string&, Bytes, const JournalPlace&) { return true; });
  const JournalPlace place = journal->Append(1, "A", Payload(1));
  EXPECT_FALSE(journal->Sync());
  EXPECT_TRUE(journal->HasUnsynced());
  EXPECT_EQ(journal->Read(place), Payload(1));
}

}  // namespace
}  // namespace pangea
