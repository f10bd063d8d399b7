#include "journal_follower/journal_follower.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "bus/retransmission/timeouts.h"
#include "messages/channels.h"
#include "messages/encoding.h"
#include "messages/messages.h"

namespace pangea {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using Which = JournalFollower::Which;

constexpr int64_t kTick_us = 100'000;
const MapId kMap{1, 1000};

// A follower on a bus, the messages that it delivers, and its requests ("KEYFRAME_1 3-5").
struct Follower {
  explicit Follower(const JournalFollower::Follows& follows)
      : node(bus, "test"),
        journal(node, follows,
                {.keyframe = [this](const Keyframe& keyframe) { seqs.push_back(keyframe.id.seq); },
                 .match =
                     [this](const PlaceMatch& match) {
                       matches.push_back(match.query.seq);
                       return has_room;
                     },
                 .result = [this](const Constraint& result) { results.push_back(result.to.seq); },
                 .more_to_catch_up = [this] { return more_to_catch_up; },
                 .handled = [this] { ++handled; }}) {
    bus.Subscribe("RESEND_REQUEST", [this](const std::string&, Bytes data) {
      resend_request_t request{};
      ASSERT_TRUE(DecodeMessage(data, &request));
      EXPECT_EQ(request.requester, "test");
      requests.push_back(request.channel + " " + std::to_string(request.from_seq) + "-" +
                         std::to_string(request.to_seq));
    });
  }
  static KeyframeMessage Message(int32_t seq, int32_t from_seq) {
    Keyframe keyframe;
    keyframe.id = {kMap, seq};
    keyframe.camera.width = keyframe.camera.height = 100;
    keyframe.camera.fx = keyframe.camera.fy = 100;
    if (seq > 0) {
      keyframe.edge = OdometryEdge{from_seq, {}, Matrix6d::Identity()};
    }
    return ToMessage(keyframe);
  }
  void Send(int32_t seq) { Send(seq, seq - 1); }
  void Send(int32_t seq, int32_t from_seq) {
    PublishMessage(bus, "KEYFRAME_1", Message(seq, from_seq));
    bus.Drain();
  }
  template <typename Message>
  void Answer(const std::string& channel, const Message& message) {
    Retransmit(node, "test", channel, message);
    bus.Drain();
  }
  void AnswerKeyframe(int32_t seq) { Answer("KEYFRAME_1", Message(seq, seq - 1)); }
  void SendMatch(int32_t seq) {
    PlaceMatch match;
    match.query = {kMap, seq};
    PublishMessage(bus, "PLACE_MATCH", ToMessage(match));
    bus.Drain();
  }
  void Have(int32_t highest_seq, const std::vector<SeqGap>& gaps = {}) {
    have_t have{};
    have.num_maps = 1;
    have.maps = {ToMessage(kMap)};
    have.highest_seq = {highest_seq};
    for (const SeqGap& gap : gaps) {
      seq_gap_t& lost = have.gaps.emplace_back();
      lost.map = ToMessage(gap.map);
      lost.from_seq = gap.from_seq;
      lost.to_seq = gap.to_seq;
    }
    have.num_gaps = static_cast<int16_t>(have.gaps.size());
    PublishMessage(bus, "HAVE", have);
    bus.Drain();
  }
  void Tick(int64_t for_us, bool ask_for_matches = true) {
    for (const int64_t end = now + for_us; now < end;) {
      journal.Tick(now += kTick_us, ask_for_matches);
      bus.Drain();
    }
  }

  LocalBus bus;
  Node node;
  std::vector<int32_t> seqs, matches, results;
  std::vector<std::string> requests;
  bool has_room = true;
  int64_t more_to_catch_up = 0;
  int handled = 0;
  JournalFollower journal;
  int64_t now = 0;
};

TEST(JournalFollower, HandsOnInOrderOrAsTheyCome) {
  Follower as_they_come({});
  Follower in_order({.in_order = true});
  for (const int32_t seq : {0, 2, 1, 1, 3}) {
    as_they_come.Send(seq);
    in_order.Send(seq);
  }
  EXPECT_THAT(as_they_come.seqs, ElementsAre(0, 2, 1, 1, 3));
  EXPECT_THAT(in_order.seqs, ElementsAre(0, 1, 2, 3));
  EXPECT_EQ(in_order.handled, 5);
  in_order.Tick(timeouts::kSecond_us);
  EXPECT_THAT(in_order.requests, IsEmpty());
}

TEST(JournalFollower, AsksForAGapThatStaysAndTakesTheAnswers) {
  for (const bool is_in_order : {false, true}) {
    Follower follower({.in_order = is_in_order});
    follower.Send(0);
    follower.Send(3);
    follower.Tick(timeouts::kGapWait_us);
    EXPECT_THAT(follower.requests, IsEmpty());
    follower.Tick(kTick_us);
    EXPECT_THAT(follower.requests, ElementsAre("KEYFRAME_1 1-2"));
    follower.Tick(timeouts::kRequestInterval_us);
    EXPECT_EQ(follower.requests.size(), 2u);
    follower.AnswerKeyframe(2);
    follower.AnswerKeyframe(1);
    follower.Tick(5 * timeouts::kSecond_us);
    EXPECT_EQ(follower.seqs.size(), 4u);
    EXPECT_EQ(follower.requests.size(), 2u);
  }
}

TEST(JournalFollower, PassesOverWhatIsLostAndCountsIt) {
  Follower by_edge({.in_order = true});
  by_edge.Send(0);
  by_edge.Send(4, 1);  // 2 and 3 are lost, 1 may still come
  EXPECT_THAT(by_edge.seqs, ElementsAre(0));
  by_edge.Send(1);
  EXPECT_THAT(by_edge.seqs, ElementsAre(0, 1, 4));
  EXPECT_EQ(by_edge.node.Status(0, 0, "").dropped, 2);
  Follower by_have({.in_order = true});
  by_have.Send(0);
  by_have.Send(3);
  by_have.Have(3, {{kMap, 1, 2}});
  EXPECT_THAT(by_have.seqs, ElementsAre(0, 3));
  EXPECT_EQ(by_have.node.Status(0, 0, "").dropped, 2);
}

TEST(JournalFollower, GivesUpOnWhatNobodySendsOnlyIfToldTo) {
  for (const bool gives_up : {false, true}) {
    Follower follower({.in_order = true, .gives_up = gives_up});
    follower.Send(0);
    follower.Send(6);
    follower.Tick((timeouts::kMaxRequests + 1) * timeouts::kRequestInterval_us);
    EXPECT_EQ(follower.seqs.size(), gives_up ? 2u : 1u);
    EXPECT_EQ(follower.node.Status(0, 0, "").dropped, gives_up ? 5 : 0);
    const size_t asked = follower.requests.size();
    follower.Tick(5 * timeouts::kSecond_us);
    EXPECT_EQ(follower.requests.size(), asked + (gives_up ? 0u : 5u));
  }
}

TEST(JournalFollower, CatchesUpAtOnceAPartAtATime) {
  Follower follower({.in_order = true, .results = Which::kAll, .states = true});
  follower.Have(99);
  EXPECT_TRUE(follower.journal.catching_up());
  EXPECT_EQ(follower.journal.num_to_catch_up(), 100);
  EXPECT_EQ(follower.journal.Goal(kMap), 99);
  follower.Tick(kTick_us);
  EXPECT_THAT(follower.requests,
              ElementsAre("CONSTRAINT 0-99", "KEYFRAME_1 0-49", "MAP_STATE 0-0"));
  for (int32_t seq = 0; seq < 100; ++seq) {
    follower.AnswerKeyframe(seq);
    if (seq == 49) {
      follower.Tick(kTick_us);
      EXPECT_EQ(follower.requests.back(), "KEYFRAME_1 50-99");
    }
  }
  EXPECT_TRUE(follower.journal.catching_up()) << "the state is still to come";
  follower.journal.NoteStates({kMap});
  EXPECT_FALSE(follower.journal.catching_up());
  follower.Have(99);
  follower.Tick(5 * timeouts::kSecond_us);
  EXPECT_EQ(follower.requests.size(), 4u);
}

TEST(JournalFollower, CatchesUpWithMatchesAndWhatTheProcessAdds) {
  Follower follower({.matches = Which::kAll});
  follower.Have(0);
  EXPECT_EQ(follower.journal.num_to_catch_up(), 2);
  follower.AnswerKeyframe(0);
  follower.more_to_catch_up = 1;
  follower.SendMatch(0);
  EXPECT_TRUE(follower.journal.catching_up());
  EXPECT_EQ(follower.journal.num_to_catch_up(), 1);
  follower.more_to_catch_up = 0;
  follower.Tick(kTick_us);
  EXPECT_FALSE(follower.journal.catching_up());
}

TEST(JournalFollower, CatchesUpNoLongerThanSomethingComes) {
  Follower follower({});
  follower.Have(3);
  follower.Tick(timeouts::kCatchUpSilence_us - kTick_us);
  follower.AnswerKeyframe(0);
  follower.Tick(timeouts::kCatchUpSilence_us);
  EXPECT_TRUE(follower.journal.catching_up());
  follower.Tick(kTick_us);
  EXPECT_FALSE(follower.journal.catching_up());
  follower.Have(3);  // said once a second
  EXPECT_FALSE(follower.journal.catching_up());
  EXPECT_FALSE(follower.requests.empty());
}

TEST(JournalFollower, WhoFollowsFromTheStartDoesNotCatchUp) {
  Follower follower({.in_order = true, .states = true});
  follower.Send(0);
  follower.Have(0);
  EXPECT_FALSE(follower.journal.catching_up());
  follower.Tick(5 * timeouts::kSecond_us);
  EXPECT_THAT(follower.requests, IsEmpty());
}

TEST(JournalFollower, MatchesOfFormerRunsAreAskedForBeforeTheirKeyframes) {
  Follower follower({.in_order = true, .matches = Which::kOfFormerRuns});
  follower.Have(1);
  follower.Tick(kTick_us);
  EXPECT_THAT(follower.requests, ElementsAre("PLACE_MATCH 0-1", "KEYFRAME_1 0-1"));
  PlaceMatch match;
  match.query = {kMap, 1};
  follower.Answer("PLACE_MATCH", ToMessage(match));
  follower.SendMatch(0);  // its own, of this run
  EXPECT_THAT(follower.matches, ElementsAre(1));
  follower.AnswerKeyframe(0);
  follower.AnswerKeyframe(1);
  EXPECT_FALSE(follower.journal.catching_up());
  follower.Send(3);
  follower.Tick(timeouts::kSecond_us);
  EXPECT_THAT(follower.requests,
              ElementsAre("PLACE_MATCH 0-1", "KEYFRAME_1 0-1", "KEYFRAME_1 2-2"));
}

TEST(JournalFollower, AMatchThatIsNotTakenIsAskedForOnceThereIsRoom) {
  Follower follower({.matches = Which::kAll});
  follower.Send(0);
  follower.has_room = false;
  follower.SendMatch(0);
  follower.Have(0);
  follower.Tick(5 * timeouts::kSecond_us, false);
  EXPECT_FALSE(follower.journal.HasMatch({kMap, 0}));
  EXPECT_THAT(follower.requests, IsEmpty());
  follower.has_room = true;
  follower.Tick(timeouts::kSecond_us);
  EXPECT_THAT(follower.requests, ElementsAre("PLACE_MATCH 0-0"));
  follower.SendMatch(0);
  EXPECT_TRUE(follower.journal.HasMatch({kMap, 0}));
}

TEST(JournalFollower, ResultsComeAsFollowed) {
  Constraint result;
  result.from = {kMap, 0};
  result.to = {kMap, 5};
  result.reason = "too few inliers";
  const std::vector<std::pair<Which, size_t>> cases{
      {Which::kNone, 0}, {Which::kOfFormerRuns, 1}, {Which::kAll, 2}};
  for (const auto& [which, expected] : cases) {
    Follower follower({.results = which});
    follower.Have(5);
    EXPECT_EQ(follower.requests.size(), which == Which::kNone ? 0u : 1u);
    PublishMessage(follower.bus, "CONSTRAINT", ToMessage(result));
    follower.Answer("CONSTRAINT", ToMessage(result));
    EXPECT_EQ(follower.results.size(), expected);
    EXPECT_EQ(follower.node.Status(0, 0, "").num_refused, which == Which::kNone ? 1 : 0);
  }
}

TEST(JournalFollower, AnAbsurdEdgeFillsNoMemory) {
  Follower follower({.in_order = true});
  follower.Send(0);
  follower.Send(900'000, 0);
  EXPECT_THAT(follower.seqs, ElementsAre(0));
  EXPECT_EQ(follower.journal.num_buffered(), 1u);
}

}  // namespace
}  // namespace pangea
