// The site's journal in NATS, who may write it, and a standby that takes over; against a real
// nats-server.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <optional>
#include <thread>

#include "bus/wall_clock.h"
#include "cluster/bridge_test_world.h"
#include "cluster/standby.h"
#include "log_file/log_reader.h"
#include "log_file/log_writer.h"
#include "messages/catch_up_messages.h"

namespace pangea {
namespace {

namespace fs = std::filesystem;

using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

struct Written {
  int64_t utime;
  std::string channel;
  std::vector<uint8_t> data;
  bool operator==(const Written&) const = default;
};

std::vector<Written> EventsOf(const std::string& journal) {
  std::vector<Written> events;
  LogReader reader(journal);
  while (const LogEvent* event = reader.Next()) {
    events.push_back({event->utime, event->channel, {event->data.begin(), event->data.end()}});
  }
  return events;
}

class StandbyTest : public ClusterTest {
 protected:
  StandbyTest() : ClusterTest("standby") {}
  void SetUp() override {
    ClusterTest::SetUp();
    if (!IsSkipped()) {
      streams_ = std::make_unique<SiteStreams>(nats_->access(), "hall");
      for (const char* suffix : {"", ".stream"}) {
        fs::remove(copy_ + suffix);
      }
    }
  }
  void AddKeyframes(int count) {
    for (int i = 0; i < count; ++i) {
      server_->Add(0);
      server_->Round(now_);
    }
  }
  // The core stays silent for so long, and the standby looks at it all the while.
  bool TakesOverWithin(Standby& standby, int64_t silence_us) {
    for (const int64_t end = now_ + silence_us; now_ < end; now_ += 100'000) {
      if (standby.Step(now_)) {
        return true;
      }
    }
    return false;
  }

  const std::string copy_ = testing::TempDir() + "/cluster_copy.lcm";
  int64_t now_ = WallUtime();
  std::unique_ptr<SiteStreams> streams_;  // of the standby's host
};

TEST_F(StandbyTest, TakesOverWhenTheCoreIsSilentWithAllThatWasReplicated) {
  AddKeyframes(5);
  EXPECT_TRUE(server_->all_replicated());
  Standby standby(copy_, *streams_, "second");
  for (int i = 0; i < 100; ++i, now_ += 100'000) {
    ASSERT_FALSE(standby.Step(now_)) << "the core lives";
    server_->Round(now_);
  }
  AddKeyframes(2);
  // The lease last moved at most one renewal ago.
  EXPECT_FALSE(TakesOverWithin(standby, SiteLease::kHeld_us - SiteLease::kRenew_us - 200'000));
  EXPECT_TRUE(TakesOverWithin(standby, SiteLease::kRenew_us + 500'000));
  EXPECT_THAT(EventsOf(copy_), SizeIs(7));
  EXPECT_EQ(EventsOf(copy_), EventsOf(server_->journal_path()));
  const JournalCursor cursor = JournalCursor::Read(copy_, *streams_);
  EXPECT_EQ(cursor.file.num_bytes, static_cast<int64_t>(fs::file_size(copy_)));
  EXPECT_EQ(cursor.sequence, streams_->JournalEnd());
}

TEST_F(StandbyTest, ABridgeOnTheCopyGoesOnWhereTheFormerCoreEnded) {
  AddKeyframes(3);
  std::optional<Standby> standby(std::in_place, copy_, *streams_, "second");
  ASSERT_TRUE(TakesOverWithin(*standby, 5'000'000));
  standby.reset();
  SiteLease lease(*streams_, "second");
  ASSERT_TRUE(lease.TryAcquire(now_));
  LocalBus bus;
  Node node(bus, "agent_handler");
  int64_t replicated_bytes = -1;
  node.Listen<journal_file_t>("JOURNAL_REPLICATED", [&](const JournalFile& file) {
    replicated_bytes = file.state.num_bytes;
  });
  CoreBridge bridge(bus, *streams_, lease);
  const auto end = streams_->JournalEnd();
  const auto round = [&] {
    bridge.BetweenMessages(now_);
    bridge.Tick(now_);
    bus.Drain();
  };
  round();
  EXPECT_EQ(replicated_bytes, -1) << "it has not been told which journal";
  Journal journal(copy_, [](const std::string&, Bytes, const JournalPlace&) { return true; });
  node.Publish("JOURNAL_FILE", ToMessage(JournalFile{copy_, journal.state()}));
  bus.Drain();
  round();
  EXPECT_EQ(replicated_bytes, journal.size());
  EXPECT_EQ(streams_->JournalEnd(), end) << "nothing is stored twice";
  journal.Append(1, "OPTIONS_fusion", std::vector<uint8_t>{1});
  journal.Sync();
  node.Publish("JOURNAL_FILE", ToMessage(JournalFile{copy_, journal.state()}));
  bus.Drain();
  EXPECT_EQ(replicated_bytes, journal.size());
  EXPECT_EQ(streams_->JournalEnd(), *end + 1);
}

// What was compared once need not be compared again: each event is a question to NATS.
TEST_F(StandbyTest, AStartComparesOnlyTheNewestEvents) {
  AddKeyframes(int{JournalShipper::kEventsPerMark} + 5);
  ASSERT_TRUE(server_->all_replicated());
  const auto newest = [this](const std::string& journal) {
    return JournalCursor::Read(journal, *streams_).sequence;
  };
  const uint64_t mark = newest(server_->journal_path());
  EXPECT_GE(mark, JournalShipper::kEventsPerMark);
  JournalCopy copy(copy_, *streams_);
  while (copy.Follow()) {
  }
  EXPECT_EQ(newest(copy_), mark);
  EXPECT_EQ(EventsOf(copy_), EventsOf(server_->journal_path()));
  server_->RestartBridge();
  AddKeyframes(2);
  EXPECT_TRUE(server_->all_replicated());
  EXPECT_EQ(EventsOf(server_->journal_path()).size(), JournalShipper::kEventsPerMark + 7);
}

// Fencing: its lease was taken while it slept, and it does not know.
TEST_F(StandbyTest, AFormerCoreStoresNothingMore) {
  AddKeyframes(3);
  Standby standby(copy_, *streams_, "second");
  ASSERT_TRUE(TakesOverWithin(standby, 5'000'000));
  const auto end = streams_->JournalEnd();
  server_->Add(0);
  EXPECT_THROW(server_->Drain(), LeaseLost);
  EXPECT_FALSE(server_->all_replicated()) << "it acknowledges nothing";
  EXPECT_EQ(streams_->JournalEnd(), end);
  EXPECT_THROW(server_->Round(now_ + 1'000'000), LeaseLost);
}

// It was cut off from NATS, and wrote what it told nobody was kept.
TEST_F(StandbyTest, AFormerCoresJournalBecomesTheSitesAgain) {
  AddKeyframes(3);
  Standby standby(copy_, *streams_, "second");
  ASSERT_TRUE(TakesOverWithin(standby, 5'000'000));
  server_->Add(0);
  EXPECT_THROW(server_->Drain(), LeaseLost);
  const std::string journal = server_->journal_path();
  server_.reset();
  ASSERT_THAT(EventsOf(journal), SizeIs(4));
  const auto answer = streams_->StoreEvent("OPTIONS_fusion", 7, std::vector<uint8_t>{1, 2, 3},
                                           *streams_->JournalEnd());
  ASSERT_EQ(answer.stored, SiteStreams::Stored::kNew);
  JournalCopy copy(journal, *streams_);
  while (copy.Follow()) {
  }
  EXPECT_THAT(EventsOf(journal), SizeIs(4));
  EXPECT_EQ(EventsOf(journal).back(), (Written{7, "OPTIONS_fusion", {1, 2, 3}}));
  ASSERT_THAT(copy.cut(), HasSubstr(journal + ".damaged-"));
  EXPECT_TRUE(fs::exists(copy.cut()));
  fs::remove(copy.cut());
}

// NATS has lost its disk, or the site was one host's before.
TEST_F(StandbyTest, AJournalGoesIntoAnEmptyStream) {
  AddKeyframes(4);
  JournalCursor{{static_cast<int64_t>(fs::file_size(server_->journal_path())), -1, 0}, 5, 1}.Write(
      server_->journal_path());
  server_->RestartBridge("attic");
  for (int i = 0; i < 3; ++i) {
    server_->Round(now_);
  }
  SiteStreams attic(nats_->access(), "attic");
  JournalCopy copy(copy_, attic);
  while (copy.Follow()) {
  }
  EXPECT_EQ(EventsOf(copy_), EventsOf(server_->journal_path()));
}

TEST_F(StandbyTest, AnotherSitesJournalIsRefused) {
  AddKeyframes(1);
  {
    LogFileWriter other(copy_);
    other.Write(1, "OPTIONS_fusion", std::vector<uint8_t>{9});
  }
  JournalCopy copy(copy_, *streams_);
  try {
    copy.Follow();
    FAIL() << "it took it";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("if it was compacted, move it away"));
  }
  EXPECT_THAT(EventsOf(copy_), SizeIs(1)) << "it stays as it is";
}

TEST_F(StandbyTest, ALeaseThatWasGivenBackIsFreeAtOnceAndOneOfTheSameHolderIsIts) {
  SiteStreams other(nats_->access(), "lab");
  other.Make();
  SiteLease first(other, "first");
  ASSERT_TRUE(first.TryAcquire(now_));
  SiteLease second(other, "second");
  EXPECT_FALSE(second.TryAcquire(now_));
  EXPECT_EQ(second.seen_holder(), "first");
  SiteLease again(other, "first");
  EXPECT_TRUE(again.TryAcquire(now_)) << "started again";
  EXPECT_GT(again.term(), first.term());
  again.Release();
  EXPECT_TRUE(second.TryAcquire(now_ + 100'000));
  EXPECT_FALSE(again.Renew(now_ + 1'000'000));
}

// Nobody takes what its holder cannot write.
TEST_F(StandbyTest, WhileNatsIsGoneNobodyTakesTheLease) {
  Standby standby(copy_, *streams_, "second");
  EXPECT_FALSE(standby.Step(now_));
  nats_->Stop();
  EXPECT_FALSE(TakesOverWithin(standby, 2 * SiteLease::kHeld_us));
  nats_->Start();
  while (!streams_->connected()) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  EXPECT_FALSE(TakesOverWithin(standby, SiteLease::kHeld_us - 200'000));
  EXPECT_TRUE(TakesOverWithin(standby, 500'000));
}

}  // namespace
}  // namespace pangea
