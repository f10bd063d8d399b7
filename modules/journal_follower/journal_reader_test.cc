// Tests how a follower reads the journal's file. journal_follower_test.cc tests how it follows the
// bus.
#include "journal_follower/journal_reader.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include "bus/retransmission/timeouts.h"
#include "journal_follower/journal_follower.h"
#include "log_file/checksums.h"
#include "messages/channels.h"
#include "messages/encoding.h"

namespace pangea {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using Which = JournalFollower::Which;

const MapId kReadMap{1, 1000};

// A journal file in a folder that only this test uses.
class TestJournal {
 public:
  TestJournal() : folder_(testing::TempDir() + "/journal_reader_" + std::to_string(getpid())) {
    std::filesystem::create_directories(folder_);
  }
  ~TestJournal() { std::filesystem::remove_all(folder_); }

  template <typename Message>
  void Add(const std::string& channel, const Message& message) {
    std::vector<uint8_t> event;
    AppendLogEvent(number_++, 0, channel, EncodeMessage(message), &event);
    state_.last_event_offset = state_.num_bytes;
    state_.last_event_crc32 = EventChecksum(event);
    state_.num_bytes += static_cast<int64_t>(event.size());
    std::ofstream(path(), std::ios::binary | std::ios::app)
        .write(reinterpret_cast<const char*>(event.data()),
               static_cast<std::streamsize>(event.size()));
  }
  void AddKeyframe(int32_t seq) {
    Keyframe keyframe;
    keyframe.id = {kReadMap, seq};
    keyframe.camera.width = keyframe.camera.height = 100;
    keyframe.camera.fx = keyframe.camera.fy = 100;
    if (seq > 0) {
      keyframe.edge = OdometryEdge{seq - 1, {}, Matrix6d::Identity()};
    }
    Add("KEYFRAME_1", ToMessage(keyframe));
  }
  void AddMatch(int32_t seq) {
    PlaceMatch match;
    match.query = {kReadMap, seq};
    Add("PLACE_MATCH", ToMessage(match));
  }
  void AddResult(int32_t from_seq, int32_t to_seq) {
    Constraint result;
    result.from = {kReadMap, from_seq};
    result.to = {kReadMap, to_seq};
    result.reason = "too few inliers";
    Add("CONSTRAINT", ToMessage(result));
  }
  // Adds keyframes, each with its match, and from the second on with a verification result.
  void AddKeyframes(int32_t count) {
    for (int32_t seq = 0; seq < count; ++seq) {
      AddKeyframe(seq);
      AddMatch(seq);
      if (seq > 0) {
        AddResult(seq - 1, seq);
      }
    }
  }

  // Starts a new journal, as if the file had been emptied.
  void Restart() { state_ = {}; }

  std::string path() const { return folder_ + "/journal.lcm"; }
  JournalFile file() const { return {path(), state_}; }

 private:
  const std::string folder_;
  int64_t number_ = 0;
  JournalState state_;
};

// A bus whose idle work waits until the test does it.
class IdleBus : public LocalBus {
 public:
  void WorkWhenIdle(const std::function<bool()>& piece) override { work_ = piece; }
  bool DoPiece() { return work_(); }
  void DoAll() {
    while (DoPiece()) {
    }
    Drain();
  }

 private:
  std::function<bool()> work_;
};

// A follower, the messages that it delivers ("k0 m0 r0"), and its requests.
struct ReadingFollower {
  explicit ReadingFollower(const JournalFollower::Follows& follows,
                           const JournalCheckpoint& checkpoint = {})
      : node(bus, "test"),
        journal(node, follows,
                {.keyframe = [this](const Keyframe& k) { Took("k", k.id.seq); },
                 .match =
                     [this](const PlaceMatch& m) {
                       Took("m", m.query.seq);
                       return true;
                     },
                 .result = [this](const Constraint& r) { Took("r", r.to.seq); },
                 .anchor_edit =
                     [this](const AnchorEdit& e) { Took("e", static_cast<int32_t>(e.seq)); }},
                checkpoint) {
    bus.Subscribe("RESEND_REQUEST", [this](const std::string&, Bytes data) {
      resend_request_t request{};
      ASSERT_TRUE(DecodeMessage(data, &request));
      requests.push_back(request.channel + " " + std::to_string(request.from_seq) + "-" +
                         std::to_string(request.to_seq));
    });
  }
  void Took(const char* what, int32_t seq) {
    if (fails) {
      throw std::runtime_error("the process cannot go on");
    }
    taken += what + std::to_string(seq) + " ";
  }
  void Tell(const JournalFile& file) {
    PublishMessage(bus, "JOURNAL_FILE", ToMessage(file));
    bus.Drain();
  }
  void Have(int32_t highest_seq) {
    have_t have{};
    have.num_maps = 1;
    have.maps = {ToMessage(kReadMap)};
    have.highest_seq = {highest_seq};
    PublishMessage(bus, "HAVE", have);
    bus.Drain();
  }
  void Tick(int64_t for_us) {
    for (const int64_t end = now + for_us; now < end;) {
      journal.Tick(now += 100'000);
      bus.Drain();
    }
  }

  IdleBus bus;
  Node node;
  bool fails = false;
  std::string taken;
  std::vector<std::string> requests;
  JournalFollower journal;
  int64_t now = 0;
};

constexpr JournalFollower::Follows kAll{
    .in_order = true, .matches = Which::kAll, .results = Which::kAll};

TEST(JournalReader, AFollowerReadsTheFileAndAsksOnlyForWhatCameLater) {
  TestJournal journal;
  journal.AddKeyframes(3);
  ReadingFollower follower(kAll);
  follower.Tell(journal.file());
  EXPECT_TRUE(follower.journal.catching_up());
  follower.bus.DoAll();
  EXPECT_EQ(follower.taken, "k0 m0 k1 m1 r1 k2 m2 r2 ");
  EXPECT_FALSE(follower.journal.catching_up());
  follower.Have(2);
  follower.Tick(5 * timeouts::kSecond_us);
  EXPECT_THAT(follower.requests, IsEmpty());
  EXPECT_TRUE(CounterOf(follower.node.Status(0, 0, ""), "ready_utime"));
  follower.Have(4);
  follower.Tick(timeouts::kSecond_us);
  EXPECT_THAT(follower.requests, ElementsAre("KEYFRAME_1 3-4", "PLACE_MATCH 3-4"));
}

TEST(JournalReader, WhatAProcessSaidInFormerRunsComesFirst) {
  TestJournal journal;
  journal.AddKeyframes(2);
  ReadingFollower matches({.in_order = true, .matches = Which::kOfFormerRuns});
  ReadingFollower results({.matches = Which::kAll, .results = Which::kOfFormerRuns});
  for (ReadingFollower* follower : {&matches, &results}) {
    follower->Tell(journal.file());
    follower->bus.DoAll();
  }
  EXPECT_EQ(matches.taken, "m0 m1 k0 k1 ");
  EXPECT_EQ(results.taken, "r1 k0 m0 k1 m1 ");
}

TEST(JournalReader, WhileTheFileIsReadNothingIsAskedFor) {
  TestJournal journal;
  journal.AddKeyframes(2000);
  ReadingFollower follower(kAll);
  follower.Tell(journal.file());
  ASSERT_TRUE(follower.bus.DoPiece()) << "one piece is not all of it";
  EXPECT_GT(follower.journal.num_to_catch_up(), 0);
  follower.Have(1999);
  follower.Tick(5 * timeouts::kSecond_us);
  EXPECT_THAT(follower.requests, IsEmpty());
  EXPECT_TRUE(follower.journal.catching_up());
  EXPECT_FALSE(CounterOf(follower.node.Status(0, 0, ""), "ready_utime"));
  follower.bus.DoAll();
  EXPECT_EQ(follower.journal.next(kReadMap), 2000);
}

TEST(JournalReader, AnErrorOfTheProcessIsNotTakenForOneOfTheFile) {
  TestJournal journal;
  journal.AddKeyframes(3);
  ReadingFollower follower(kAll);
  follower.Tell(journal.file());
  follower.fails = true;
  EXPECT_THROW(follower.bus.DoAll(), std::runtime_error);
}

TEST(JournalReader, TheStatesOfItsMapsAreAwaited) {
  TestJournal journal;
  journal.AddKeyframe(0);
  ReadingFollower follower({.in_order = true, .states = true});
  follower.Tell(journal.file());
  follower.bus.DoAll();
  EXPECT_TRUE(follower.journal.catching_up());
  follower.Tick(100'000);
  EXPECT_THAT(follower.requests, ElementsAre("MAP_STATE 0-0"));
  follower.journal.NoteStates({kReadMap});
  EXPECT_FALSE(follower.journal.catching_up());
}

TEST(JournalReader, AStateThatComesWhileTheFileIsReadIsNotAskedFor) {
  TestJournal journal;
  journal.AddKeyframe(0);
  ReadingFollower follower({.in_order = true, .states = true});
  follower.Tell(journal.file());
  follower.journal.NoteStates({kReadMap});
  follower.bus.DoAll();
  EXPECT_FALSE(follower.journal.catching_up());
}

TEST(JournalReader, WhatWasNotYetSaidToBeThereIsNotTaken) {
  TestJournal journal;
  journal.AddKeyframe(0);
  const JournalFile file = journal.file();
  journal.AddKeyframe(1);
  std::ofstream(journal.path(), std::ios::app) << "half an event";
  ReadingFollower follower(kAll);
  follower.Tell(file);
  follower.bus.DoAll();
  EXPECT_EQ(follower.taken, "k0 ");
}

TEST(JournalReader, EditsOfAnchorsComeTooAndDamageCostsWhatItHit) {
  TestJournal journal;
  AnchorEdit edit;
  edit.anchor = {1, 5};
  edit.revision = 1;
  edit.agent_id = 1;
  edit.seq = 0;
  journal.Add("ANCHOR_EDIT", ToMessage(edit));
  const int64_t second = journal.file().state.num_bytes;
  journal.AddKeyframe(0);
  journal.AddKeyframe(1);
  std::fstream(journal.path(), std::ios::binary | std::ios::in | std::ios::out)
      .seekp(second)
      .write("damage", 6);
  ReadingFollower follower({});
  follower.Tell(journal.file());
  follower.bus.DoAll();
  EXPECT_EQ(follower.taken, "e0 k1 ");
}

TEST(JournalReader, AFileThatIsNotTheJournalIsLeftAndTheBusAsked) {
  TestJournal journal;
  journal.AddKeyframes(2);
  std::vector<JournalFile> files(4, journal.file());
  files[0].path += ".gone";
  files[1].path = "/dev/zero";
  files[2].state.num_bytes += 1000;
  ++files[3].state.last_event_crc32;
  for (const JournalFile& file : files) {
    ReadingFollower follower(kAll);
    follower.Tell(file);
    EXPECT_FALSE(follower.journal.reading()) << file.path;
    follower.Have(1);
    follower.Tick(100'000);
    EXPECT_EQ(follower.taken, "");
    EXPECT_THAT(follower.requests, ElementsAre("CONSTRAINT 0-1", "KEYFRAME_1 0-1"));
  }
}

// A follower that restores its state from a checkpoint takes the rest of the journal, and can write
// a new checkpoint.
class JournalCheckpoints : public testing::Test {
 protected:
  std::string Write() { return Taken(true); }
  std::string Taken(bool writes = false) {
    ReadingFollower follower(follows_,
                             {.place = {journal_.path() + ".checkpoint", options_, writes},
                              .save = [](ByteWriter* writer) { writer->Put(7); },
                              .restore =
                                  [this](ByteReader* reader) {
                                    int seven = 0;
                                    reader->Get(&seven);
                                    return seven == 7 && reader->at_end() && !refuses_;
                                  },
                              .keyframe_is_complete = is_complete_});
    follower.Tell(journal_.file());
    follower.bus.DoAll();
    return follower.taken;
  }

  TestJournal journal_;
  JournalFollower::Follows follows_{.in_order = true, .matches = Which::kAll};
  std::function<bool(const KeyframeId&)> is_complete_;
  std::string options_;
  bool refuses_ = false;  // the process cannot restore its state
};

TEST_F(JournalCheckpoints, OnlyWhatCameSinceIsRead) {
  journal_.AddKeyframes(2);
  EXPECT_EQ(Write(), "k0 m0 k1 m1 ");
  EXPECT_EQ(Taken(), "");
  journal_.AddKeyframe(2);
  journal_.AddMatch(2);
  journal_.AddKeyframe(1);  // a repeat
  EXPECT_EQ(Taken(), "k2 m2 ");
  EXPECT_EQ(Write(), "k2 m2 ");
  EXPECT_EQ(Taken(), "");
}

TEST_F(JournalCheckpoints, EndsBeforeWhatIsNotCompleteOrWaitsBehindAGap) {
  journal_.AddKeyframes(3);
  is_complete_ = [](const KeyframeId& id) { return id.seq < 1; };
  EXPECT_EQ(Write(), "k0 m0 ");
  EXPECT_EQ(Taken(), "k1 m1 k2 m2 ");
  is_complete_ = nullptr;
  journal_.AddKeyframe(4);
  journal_.AddKeyframe(3);
  EXPECT_EQ(Write(), "k1 m1 k2 m2 ");
  EXPECT_EQ(Taken(), "k3 k4 ");
}

TEST_F(JournalCheckpoints, OfAnotherJournalOrOtherOptionsIsNotUsed) {
  journal_.AddKeyframes(2);
  Write();
  options_ = "other";
  EXPECT_EQ(Taken(), "k0 m0 k1 m1 ");
  options_ = "";
  EXPECT_EQ(Taken(), "");
  std::filesystem::resize_file(journal_.path(), 0);  // another one of the same length, and more
  journal_.Restart();
  journal_.AddMatch(0);
  journal_.AddKeyframes(3);
  EXPECT_EQ(Taken(), "m0 k0 m0 k1 m1 k2 m2 ");
}

TEST_F(JournalCheckpoints, ThatTheProcessRefusesCostsNothingOfTheJournal) {
  journal_.AddKeyframes(2);
  Write();
  refuses_ = true;
  EXPECT_EQ(Taken(), "k0 m0 k1 m1 ");
}

}  // namespace
}  // namespace pangea
