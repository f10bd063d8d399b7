// Random damage costs a journal at most the events that were hit. Later starts lose nothing more.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <lcm/lcm-cpp.hpp>
#include <map>
#include <random>

#include "agent_handler/journal/journal.h"
#include "core/server_messages.h"
#include "messages/channels.h"
#include "messages/encoding.h"
#include "messages/testing/test_keyframes.h"

namespace pangea {
namespace {

namespace fs = std::filesystem;
using File = std::vector<uint8_t>;

File Slurp(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

void Dump(const fs::path& path, const File& bytes) {
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
}

class JournalDamage : public testing::Test {
 protected:
  using Events = std::map<std::pair<std::string, File>, JournalPlace>;

  void SetUp() override {
    const fs::path memory = "/dev/shm";  // 2000 times to the disk take minutes
    folder = (fs::is_directory(memory) ? memory : fs::path(testing::TempDir())) /
             ("journal_damage_" + std::to_string(getpid()));
    Clear();
    {
      Journal journal(path(), [](const std::string&, Bytes, const JournalPlace&) { return true; });
      for (int32_t seq = 0; seq < 20; ++seq) {
        Append(&journal, "KEYFRAME_1", EncodeTestKeyframe({map, seq}));
        Append(&journal, "PLACE_MATCH", EncodeMatch(seq));
        Append(&journal, "CONSTRAINT", EncodeConstraint(seq));
      }
    }
    good = Slurp(path());
  }
  void TearDown() override { fs::remove_all(folder); }
  void Clear() const {
    fs::remove_all(folder);
    fs::create_directories(folder);
  }
  std::string path() const { return (folder / "journal.lcm").string(); }

  // Each in a write of its own.
  void Append(Journal* journal, const std::string& channel, const File& data) {
    events[{channel, data}] = journal->Append(1'000'000, channel, data);
    ASSERT_TRUE(journal->Sync());
  }
  File EncodeMatch(int32_t seq) const {
    PlaceMatch match;
    match.query = {map, seq};
    match.candidates = {{{map, 0}, PlaceKind::kIntra, 1.0f, {}}};
    return EncodeMessage(ToMessage(match));
  }
  File EncodeConstraint(int32_t seq) const {
    Constraint result;
    result.from = {map, 0};
    result.to = {map, seq};
    return EncodeMessage(ToMessage(result));
  }
  Events Read(JournalMend* mend) const {
    Events read;
    const Journal journal(path(), [&](const std::string& channel, Bytes data, const auto& place) {
      read[{channel, {data.begin(), data.end()}}] = place;
      return true;
    });
    *mend = journal.mend();
    return read;
  }
  // The number of bytes of the events that an LCM tool reads from the journal.
  int64_t BytesOfEvents() const {
    lcm::LogFile log(path(), "r");
    int64_t bytes = 0;
    while (const lcm::LogEvent* event = log.readNextEvent()) {
      bytes += 28 + static_cast<int64_t>(event->channel.size()) + event->datalen;
    }
    return bytes;
  }

  struct Tally {
    int damages = 0;
    int64_t hit = 0, lost = 0, unseen = 0;
    int64_t worst = 0;  // events lost by one damage
  };
  // `file` is `good` but for [begin, end).
  void Try(const File& file, int64_t begin, int64_t end, Tally* tally) {
    Clear();
    Dump(path(), file);
    JournalMend mend, second;
    const Events read = Read(&mend);
    const File copy = mend.copy.empty() ? File{} : Slurp(mend.copy);
    int64_t lost = 0;
    for (const auto& [event, place] : events) {
      const int64_t event_end = place.offset + place.size;
      const bool hit = place.offset < end && begin < event_end;
      tally->hit += hit ? 1 : 0;
      if (!read.contains(event)) {
        ++lost;
        ASSERT_TRUE(hit) << event.first << " at " << place.offset << " by [" << begin << ", "
                         << end;
        const auto kept = std::search(copy.begin(), copy.end(), file.begin() + place.offset,
                                      file.begin() + event_end);
        tally->unseen += kept == copy.end() ? 1 : 0;
      }
    }
    ++tally->damages;
    tally->lost += lost;
    tally->worst = std::max(tally->worst, lost);
    EXPECT_EQ(BytesOfEvents(), static_cast<int64_t>(fs::file_size(path()))) << begin;
    EXPECT_EQ(Read(&second), read) << "nothing is lost later";
    EXPECT_EQ(second.copy, "") << begin << " to " << end;
  }
  static void Print(const char* what, const Tally& tally) {
    fmt::print("| {} | {} | {} | {} | {} | {} |\n", what, tally.damages, tally.hit, tally.lost,
               tally.worst, tally.unseen);
  }

  const MapId map{1, 1000};
  fs::path folder;
  Events events;
  File good;
  std::mt19937_64 random{7};
};

TEST_F(JournalDamage, AFlippedBitLosesItsEventAtMost) {
  Tally tally;
  for (int i = 0; i < 1000; ++i) {
    File file = good;
    const auto at = static_cast<int64_t>(random() % good.size());
    file[static_cast<size_t>(at)] ^= static_cast<uint8_t>(1 << random() % 8);
    Try(file, at, at + 1, &tally);
  }
  Print("one bit", tally);
  EXPECT_EQ(tally.worst, 1);
  EXPECT_EQ(tally.unseen, 0) << "each is seen, and kept beside";
}

TEST_F(JournalDamage, ADamagedBlockLosesTheEventsItHitsAtMost) {
  Tally tally;
  for (int i = 0; i < 1000; ++i) {
    File file = good;
    const auto at = static_cast<int64_t>(random() % (good.size() - 4096));
    std::generate_n(file.begin() + at, 4096,
                    [&] { return i % 2 == 0 ? uint8_t{0} : static_cast<uint8_t>(random()); });
    Try(file, at, at + 4096, &tally);
  }
  Print("4 kB", tally);
  // The last list of checksums can go with the end of the last event.
  EXPECT_LT(tally.unseen, 5);
}

}  // namespace
}  // namespace pangea
