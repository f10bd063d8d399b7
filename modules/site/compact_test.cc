#include "site/compact.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <fstream>

#include "site/journal_contents.h"
#include "site/site_test_world.h"

namespace pangea::site {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

// Events with repeats of all kinds, and with options that newer ones replace.
std::vector<StoredEvent> Wasteful() {
  std::vector<StoredEvent> events{OptionsEvent("fusion", "a: 1"), OptionsEvent("fusion", "a: 2")};
  for (const StoredEvent& event : WalksOf({1})) {
    events.push_back(event);
    events.push_back(event);
  }
  events.push_back(EditEvent({1, 7}, 1, 0));
  events.push_back(EditEvent({1, 7}, 1, 0));
  events.push_back(EditEvent({1, 7}, 2, 1));
  events.push_back({1'800'000'000'000'000, "OTHER", {1, 2, 3}});
  events.push_back({1'800'000'000'000'000, "OTHER", {1, 2, 3}});
  events.push_back(OptionsEvent("fusion", "a: 3"));
  return events;
}

std::vector<StoredEvent> Lean() {
  std::vector<StoredEvent> events = WalksOf({1});
  events.push_back(EditEvent({1, 7}, 1, 0));
  events.push_back(EditEvent({1, 7}, 2, 1));
  events.push_back({1'800'000'000'000'000, "OTHER", {1, 2, 3}});
  events.push_back({1'800'000'000'000'000, "OTHER", {1, 2, 3}});
  events.push_back(OptionsEvent("fusion", "a: 3"));
  return events;
}

TEST(Compact, KeepsWhatCountsInItsOrder) {
  const Site site = MakeSite(FreshFolder("compact") / "hall", Wasteful());
  fs::create_directories(site.checkpoints());
  const CompactSummary summary = Compact(site);
  EXPECT_EQ(EventsOf(site), Lean());
  EXPECT_EQ(FoundAtOpening(site), "");
  EXPECT_FALSE(fs::exists(site.checkpoints()));
  EXPECT_EQ(summary.events_before, std::ssize(Wasteful()));
  EXPECT_EQ(summary.events_after, std::ssize(Lean()));
  EXPECT_LT(summary.bytes_after, 0.55 * static_cast<double>(summary.bytes_before));
}

TEST(Compact, DropsDamageAndKeepsACopyOfIt) {
  const Site site = MakeSite(FreshFolder("compact_damage") / "hall", WalksOf({1}));
  std::fstream file(site.journal(), std::ios::in | std::ios::out | std::ios::binary);
  file.seekp(40'000);
  file.write("damage", 6);
  file.close();
  Compact(site);
  LogReadings readings;
  ReadLog(
      site.journal(), [](const LogEvent&) {}, &readings);
  EXPECT_TRUE(readings.begin()->second.whole());
  EXPECT_EQ(EventsOf(site).size(), WalksOf({1}).size() - 1);
  EXPECT_EQ(std::count_if(fs::directory_iterator(site.folder), fs::directory_iterator(),
                          [](const auto& entry) {
                            return entry.path().string().find("damaged-") != std::string::npos;
                          }),
            1);
}

// They have what the journal lost, and the next server would not see that it ever had it.
TEST(Compact, CheckpointsGoWithTheDamageAlthoughItFails) {
  const Site site = MakeSite(FreshFolder("compact_mended") / "hall", WalksOf({1}));
  std::fstream file(site.journal(), std::ios::in | std::ios::out | std::ios::binary);
  file.seekp(40'000);
  file.write("damage", 6);
  file.close();
  fs::create_directories(site.checkpoints());
  EXPECT_NE(OnFullDisk(300'000, [&] { Compact(site); }), "");
  EXPECT_EQ(FoundAtOpening(site), "") << "it is mended";
  EXPECT_FALSE(fs::exists(site.checkpoints()));
}

// A journal on another disk stays there.
TEST(Compact, FollowsALink) {
  const fs::path folder = FreshFolder("compact_link");
  const Site site = MakeSite(folder / "hall", Wasteful());
  fs::rename(site.journal(), folder / "elsewhere.lcm");
  fs::create_symlink(folder / "elsewhere.lcm", site.journal());
  Compact(site);
  EXPECT_TRUE(fs::is_symlink(site.journal()));
  EXPECT_EQ(EventsOf(site), Lean());
  EXPECT_EQ(std::distance(fs::directory_iterator(folder), fs::directory_iterator()), 2);
}

TEST(Compact, RefusesWhileTheSiteOrItsJournalIsInUse) {
  const Site site = MakeSite(FreshFolder("compact_used") / "hall", WalksOf({1}));
  {
    const Journal journal(site.journal(),
                          [](const std::string&, Bytes, const JournalPlace&) { return true; });
    EXPECT_THROW(Compact(site), std::runtime_error);
  }
  const SiteLock lock(site);
  EXPECT_THROW(Compact(site), std::runtime_error);
  EXPECT_EQ(EventsOf(site), WalksOf({1}));
}

TEST(Compact, LeavesTheOldOneWhenTheDiskIsFull) {
  const Site site = MakeSite(FreshFolder("compact_full") / "hall", Wasteful());
  EXPECT_THAT(OnFullDisk(300'000, [&] { Compact(site); }),
              HasSubstr("journal.lcm.compacting: cannot be written: File too large"));
  EXPECT_EQ(EventsOf(site), Wasteful());
  EXPECT_FALSE(fs::exists(site.folder / "journal.lcm.compacting"));
}

TEST(Compact, HasNothingToDoWithoutAJournal) {
  const Site site = CreateSite(FreshFolder("compact_empty") / "hall", NewDescription("hall"));
  EXPECT_THROW(Compact(site), std::runtime_error);
  EXPECT_FALSE(fs::exists(site.journal()));
}

// Kills the compaction (kill -9) when it reaches a step for the n-th time.
void CompactKilledAt(const Site& site, const std::optional<ThinJournal>& thin, CompactStep step,
                     int nth) {
  const pid_t child = fork();
  if (child == 0) {
    int seen = 0;
    Compact(site, thin, [&](CompactStep reached) {
      if (reached == step && ++seen == nth) {
        kill(getpid(), SIGKILL);
      }
    });
    _exit(0);
  }
  int status = 0;
  waitpid(child, &status, 0);
  ASSERT_TRUE(WIFSIGNALED(status)) << "the step was not reached";
}

// After each kill the journal must be either the old or the new one.
void ExpectOldOrNew(const std::vector<StoredEvent>& before, const std::vector<StoredEvent>& after,
                    const std::optional<ThinJournal>& thin) {
  const int num_written = static_cast<int>(after.size());
  const std::vector<std::pair<CompactStep, int>> kills{{CompactStep::kRead, 1},
                                                       {CompactStep::kWrite, 1},
                                                       {CompactStep::kWrite, num_written / 2},
                                                       {CompactStep::kWrite, num_written},
                                                       {CompactStep::kWritten, 1},
                                                       {CompactStep::kCompared, 1},
                                                       {CompactStep::kSwapped, 1},
                                                       {CompactStep::kDone, 1}};
  for (const auto& [step, nth] : kills) {
    const Site site = MakeSite(FreshFolder("compact_killed") / "hall", before);
    CompactKilledAt(site, thin, step, nth);
    const bool swapped = step >= CompactStep::kSwapped;
    EXPECT_EQ(EventsOf(site), swapped ? after : before) << static_cast<int>(step);
    EXPECT_EQ(FoundAtOpening(site), "");
    if (!swapped) {
      Compact(site, thin);  // files left by the killed run are no obstacle
      EXPECT_EQ(EventsOf(site), after);
    }
    EXPECT_FALSE(fs::exists(site.folder / "journal.lcm.compacting"));
  }
}

TEST(Compact, LeavesTheOldOrTheNewOneWholeWhereverItIsKilled) {
  ExpectOldOrNew(Wasteful(), Lean(), std::nullopt);
}

TEST(Compact, ThinningLeavesTheOldOrTheNewOneWholeWhereverItIsKilled) {
  const std::vector<StoredEvent> before = WalksAgainAndAgain();
  const ThinJournal thin = AfterTheLast(before);
  const Site site = MakeSite(FreshFolder("compact_thin") / "hall", before);
  Compact(site, thin);
  ASSERT_LT(EventsOf(site).size(), before.size());
  ExpectOldOrNew(before, EventsOf(site), thin);
}

}  // namespace
}  // namespace pangea::site
