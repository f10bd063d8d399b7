#include "agent_handler/journal/journal.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <lcm/lcm-cpp.hpp>

#include "files/testing/full_disk.h"
#include "journal_follower/journal_reader.h"
#include "log_file/log_event.h"

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
    folder = testing::TempDir() + "pangea_journal_" + std::to_string(getpid());
    std::filesystem::remove_all(folder);
    std::filesystem::create_directories(folder);
    path = folder + "/journal.lcm";
  }
  void TearDown() override { std::filesystem::remove_all(folder); }

  using Contents = std::string;
  static Contents ContentsOf(const std::filesystem::path& file) {
    std::ifstream stream(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  }
  void WriteContents(const Contents& contents) const {
    std::ofstream(path, std::ios::binary) << contents;
  }
  // Removes the copies of damaged parts that are kept beside the journal, and returns their bytes.
  Contents Copies() const {
    Contents copies;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
      if (entry.path().filename().string().starts_with("journal.lcm.damaged-")) {
        copies += ContentsOf(entry.path());
        std::filesystem::remove(entry.path());
      }
    }
    return copies;
  }

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

  // Whether a reader of the file agrees (journal_reader.h).
  bool ReadsTo(const JournalState& state) const {
    try {
      JournalReader reader({path, state});
      return true;
    } catch (const std::runtime_error&) {
      return false;
    }
  }

  std::string folder, path;
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
  const lcm::LogEvent* event = log.readNextEvent();
  ASSERT_NE(event, nullptr);
  EXPECT_EQ(event->channel, "CHECKSUMS");
  EXPECT_EQ(event->eventnum, 5);
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

// Cut at every byte: what was complete is kept, the rest is kept beside, and appending goes on.
TEST_F(JournalTest, ItsStateIsWhatIsOnTheDisk) {
  EXPECT_EQ(Open()->state(), JournalState());
  Write(3);
  const auto journal = Open();
  const JournalState state = journal->state();
  EXPECT_EQ(state.num_bytes, static_cast<int64_t>(std::filesystem::file_size(path)));
  journal->Append(4, "A", Payload(1));
  EXPECT_EQ(journal->state(), state) << "not yet on the disk";
  ASSERT_TRUE(journal->Sync());
  const JournalState after = journal->state();
  EXPECT_EQ(after.num_bytes, static_cast<int64_t>(std::filesystem::file_size(path)));
  EXPECT_GT(after.last_event_offset, state.num_bytes);
  EXPECT_TRUE(ReadsTo(after));
  EXPECT_TRUE(ReadsTo(state)) << "what it was is what it begins with";
  JournalState other = state;
  ++other.last_event_crc32;
  EXPECT_FALSE(ReadsTo(other));
}

TEST_F(JournalTest, ATornTailIsCutAndKeptBeside) {
  Write(3);
  const Contents whole = ContentsOf(path);
  Open();
  const JournalPlace last = seen[2].place;
  const int64_t last_end = last.offset + last.size;
  for (int64_t length = last.offset + 1; length < static_cast<int64_t>(whole.size()); ++length) {
    const bool has_last = length >= last_end;
    const int64_t torn = length - (has_last ? last_end : last.offset);
    WriteContents(whole.substr(0, static_cast<size_t>(length)));
    {
      const auto journal = Open();
      EXPECT_EQ(seen.size(), has_last ? 3u : 2u) << length;
      EXPECT_EQ(journal->mend().torn_bytes, torn);
      EXPECT_EQ(journal->mend().damaged_bytes, 0);
      EXPECT_EQ(Copies(), torn > 0 ? whole.substr(static_cast<size_t>(length - torn),
                                                  static_cast<size_t>(torn))
                                   : "");
      journal->Append(9, "AFTER", Payload(4));
    }
    EXPECT_EQ(Open()->mend().copy, "");
    EXPECT_EQ(seen.back().channel, "AFTER");
    EXPECT_EQ(seen.back().data, Payload(4));
  }
}

// In each place: it was cut there with all that followed, up to 2 MiB, or refused.
TEST_F(JournalTest, DamageCostsTheEventThatWasHitAlone) {
  Write(20);
  const Contents whole = ContentsOf(path);
  Open();
  const auto events = seen;
  for (size_t i = 0; i < events.size(); ++i) {
    for (const int64_t at : {0, 3, 11, 19, 23, 27, 30, 40}) {
      Contents damaged = whole;
      damaged[static_cast<size_t>(events[i].place.offset + at)] ^= 1;
      WriteContents(damaged);
      const auto journal = Open();
      EXPECT_EQ(seen.size(), events.size() - 1) << i << ", byte " << at;
      EXPECT_EQ(journal->mend().damaged_bytes, events[i].place.size);
      EXPECT_EQ(Copies(), damaged.substr(static_cast<size_t>(events[i].place.offset),
                                         static_cast<size_t>(events[i].place.size)));
      EXPECT_EQ(std::filesystem::file_size(path), whole.size());
    }
  }
}

TEST_F(JournalTest, SaysBeforeItMends) {
  Write(3);
  Contents damaged = ContentsOf(path);
  damaged[45] ^= 1;
  WriteContents(damaged);
  std::vector<Contents> found;
  const auto open = [&] {
    Journal(
        path, [](const std::string&, Bytes, const JournalPlace&) { return true; },
        [&] { found.push_back(ContentsOf(path)); });
  };
  open();
  EXPECT_EQ(found, std::vector<Contents>{damaged});
  open();
  std::filesystem::resize_file(path, std::filesystem::file_size(path) - 5);
  open();
  EXPECT_EQ(found.size(), 1u) << "a torn end is no damage";
}

TEST_F(JournalTest, WhatItsReaderCallsDamagedIsDamage) {
  {
    const auto journal = Open();
    journal->Append(1, "A", Payload(1));
    journal->Append(2, "A", Payload(99));
  }
  EXPECT_GT(Open()->mend().damaged_bytes, 0);
  EXPECT_EQ(Open()->mend().copy, "");
  EXPECT_EQ(seen.size(), 1u);
  lcm::LogFile log(path, "r");
  for (const char* channel : {"A", "DAMAGED", "CHECKSUMS"}) {
    const lcm::LogEvent* event = log.readNextEvent();
    ASSERT_NE(event, nullptr);
    EXPECT_EQ(event->channel, channel);
  }
}

// As older versions wrote it, and without a word about it.
TEST_F(JournalTest, AJournalWithoutChecksumsIsReadAsItIs) {
  std::vector<uint8_t> events;
  for (int i = 0; i < 3; ++i) {
    AppendLogEvent(i, i, "A", Payload(i), &events);
  }
  WriteContents({events.begin(), events.end()});
  Write(2);
  Open();
  ASSERT_EQ(seen.size(), 5u);
  Contents damaged = ContentsOf(path);
  damaged[static_cast<size_t>(seen[4].place.offset) + 45] ^= 4;
  damaged[static_cast<size_t>(seen[1].place.offset) + 40] ^= 4;
  WriteContents(damaged);
  EXPECT_EQ(Open()->mend().damaged_parts, 2) << "what is appended checks some before it too";
  EXPECT_EQ(seen.size(), 3u);
}

// Events that were copied into another log have other numbers: the lists beside them say nothing.
TEST_F(JournalTest, ChecksumsOfAnotherLogCondemnNothing) {
  Write(5);
  Write(5);
  const std::string copied = path + ".cut";
  {
    lcm::LogFile from(path, "r"), to(copied, "w");
    for (int i = 0; const lcm::LogEvent* event = from.readNextEvent(); ++i) {
      if (i > 2) {
        to.writeEvent(const_cast<lcm::LogEvent*>(event));
      }
    }
  }
  std::filesystem::rename(copied, path);
  EXPECT_EQ(Open()->mend().copy, "");
  EXPECT_EQ(seen.size(), 7u);
}

TEST_F(JournalTest, AFlippedBitIsSeenWhenItIsReadToo) {
  Write(1);
  const auto journal = Open();
  Contents damaged = ContentsOf(path);
  damaged[45] ^= 1;
  WriteContents(damaged);
  EXPECT_TRUE(journal->Read(seen[0].place).empty());
}

TEST_F(JournalTest, AFileThatIsNoLogStaysAsItIs) {
  for (const Contents& text : {Contents("Notes: buy milk.\n"), Contents(40, '\0'), Contents("x"),
                               Contents(3 << 20, 'y')}) {
    WriteContents(text);
    EXPECT_THROW(Open(), std::runtime_error);
    EXPECT_EQ(ContentsOf(path), text);
    EXPECT_EQ(Copies(), "");
  }
  const std::string folder = testing::TempDir();
  EXPECT_THROW(Journal(folder, [](const auto&, Bytes, const auto&) { return true; }),
               std::runtime_error);
}

// The very first write of a new journal was torn.
TEST_F(JournalTest, TheBeginOfAFirstEventIsATornTail) {
  Write(1);
  const Contents whole = ContentsOf(path);
  for (const size_t length : {1, 3, 4, 20, 40}) {
    WriteContents(whole.substr(0, length));
    EXPECT_EQ(Open()->mend().torn_bytes, static_cast<int64_t>(length));
    EXPECT_EQ(Copies(), whole.substr(0, length));
  }
}

TEST_F(JournalTest, WhatCannotBeKeptIsLeftAsItIs) {
  Write(3);
  Contents damaged = ContentsOf(path);
  damaged[45] ^= 1;
  WriteContents(damaged);
  {
    const FullDisk full(10);
    EXPECT_THROW(Open(), std::runtime_error);
  }
  EXPECT_EQ(ContentsOf(path), damaged);
  EXPECT_EQ(Copies(), "");
}

// An event needs 29 bytes: fewer between two of them become zeros, once.
TEST_F(JournalTest, DamageTooSmallForAnEventBecomesZeros) {
  std::vector<uint8_t> events;
  AppendLogEvent(0, 0, "A", Payload(0), &events);
  events.insert(events.end(), 20, 'x');
  AppendLogEvent(1, 0, "A", Payload(1), &events);
  WriteContents({events.begin(), events.end()});
  EXPECT_EQ(Open()->mend().damaged_bytes, 20);
  EXPECT_EQ(Copies(), Contents(20, 'x'));
  EXPECT_EQ(seen.size(), 2u);
  EXPECT_EQ(Open()->mend().copy, "");
  EXPECT_EQ(seen.size(), 2u);
}

TEST_F(JournalTest, EventNumbersGoOnAfterItWasOpenedAgain) {
  Write(3);
  Write(2);
  lcm::LogFile log(path, "r");
  for (int i = 0; i < 7; ++i) {  // two of them are checksums
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
