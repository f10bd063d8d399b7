#include "agent_handler/agent_handler.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "agent_handler/journal/outstanding_results.h"
#include "agent_handler/journal/resend_queue.h"
#include "link/compression.h"
#include "messages/encoding.h"
#include "messages/testing/test_keyframes.h"

namespace pangea {
namespace {

constexpr int64_t kSecond = 1'000'000;
const MapId kMap{1, 1000};

LinkPacket HelloPacket(const std::vector<LinkMap>& maps, int64_t number = 1) {
  return {LinkKind::kHello, number, Encode(LinkHello{"test", maps})};
}

LinkPacket WholeKeyframe(int seq, const std::vector<uint8_t>& compressed) {
  return {LinkKind::kLastPiece, 2,
          Encode(LinkPiece{0, static_cast<uint8_t>(seq), 0, true, compressed})};
}

class AgentHandlerTest : public testing::Test {
 protected:
  AgentHandlerTest() {
    handler.OnNewUplink();
    handler.OnPacket(HelloPacket({{kMap, 0, 0}}));
  }
  AgentHandler handler{1, {}};
};

TEST_F(AgentHandlerTest, AcknowledgesOnlyWhatIsOnTheDisk) {
  const auto bytes = EncodeTestKeyframe({kMap, 0});
  EXPECT_EQ(handler.OnPacket(WholeKeyframe(0, Compress(bytes))), "");
  const auto ready = handler.TakeReady();
  ASSERT_EQ(ready.size(), 1u);
  EXPECT_EQ(ready[0].bytes, bytes);
  auto ack = handler.TakeAck(2 * kSecond);
  ASSERT_TRUE(ack);
  EXPECT_EQ(ack->journalled_seq.at(kMap), -1);
  EXPECT_EQ(ack->partial.size(), 1u) << "it is there, and needs no repeat";
  handler.Journalled({kMap, 0});
  ack = handler.TakeAck(3 * kSecond);
  ASSERT_TRUE(ack);
  EXPECT_EQ(ack->journalled_seq.at(kMap), 0);
  EXPECT_TRUE(ack->partial.empty());
  EXPECT_FALSE(handler.TakeAck(4 * kSecond)) << "nothing new";
}

TEST_F(AgentHandlerTest, RefusesWhatDoesNotParse) {
  KeyframeMessage absurd = ToMessage(TestKeyframe({kMap, 0}));
  absurd.T_odom_body.translation.x = 1e12;
  EXPECT_NE(handler.OnPacket(WholeKeyframe(0, Compress(EncodeMessage(absurd)))), "");
  EXPECT_NE(handler.OnPacket(WholeKeyframe(0, Compress(std::vector<uint8_t>{1, 2, 3}))), "");
  EXPECT_NE(handler.OnPacket(WholeKeyframe(0, {1, 2, 3})), "") << "not even compressed";
  EXPECT_NE(handler.OnPacket(WholeKeyframe(0, Compress(EncodeTestKeyframe({kMap, 1})))), "");
  // A few kilobytes that would become 64 MB.
  EXPECT_NE(handler.OnPacket(WholeKeyframe(0, Compress(std::vector<uint8_t>(1 << 26)))), "");
  EXPECT_NE(handler.OnPacket({LinkKind{77}, 3, {}}), "");
  EXPECT_TRUE(handler.TakeReady().empty());
  EXPECT_EQ(handler.receiver().cached_bytes(), 0);
}

TEST_F(AgentHandlerTest, AnotherUplinkAnnouncesItsMapsAnew) {
  const auto keyframe = WholeKeyframe(0, Compress(EncodeTestKeyframe({kMap, 0})));
  handler.OnNewUplink();
  EXPECT_NE(handler.OnPacket(keyframe), "");
  handler.OnPacket(HelloPacket({{kMap, 0, 0, 7}}));
  EXPECT_NE(handler.OnPacket(keyframe), "") << "the map has another slot now";
  handler.OnPacket(HelloPacket({{kMap, 0, 0, 0}}));
  EXPECT_EQ(handler.OnPacket(keyframe), "");
}

// Poses are not answered one by one.
TEST_F(AgentHandlerTest, AcknowledgesHellosAndPieces) {
  ASSERT_TRUE(handler.TakeAck(kSecond));
  pose_t pose{};
  pose.state = pose_t::STATE_TRACKING;
  pose.map = ToMessage(kMap);
  pose.T_odom_body = pose.T_map_body = ToMessage(Rigid3());
  EXPECT_EQ(handler.OnPacket({LinkKind::kPose, 3, EncodePose(pose)}), "");
  EXPECT_TRUE(handler.TakePose());
  EXPECT_FALSE(handler.TakePose());
  EXPECT_FALSE(handler.TakeAck(2 * kSecond));
  handler.OnPacket(HelloPacket({{kMap, 0, 0}}, 4));
  EXPECT_EQ(handler.TakeAck(3 * kSecond).value().highest_number, 4);
}

// Acknowledgements of maps that only the journal contains answer a hello, and are not repeated.
TEST_F(AgentHandlerTest, OldMapsAreSentInAnswerToAHello) {
  const MapId old{1, 500};
  handler.Resume(old, 9);
  EXPECT_EQ(handler.TakeAck(kSecond).value().journalled_seq.at(old), 9);
  handler.OnPacket(WholeKeyframe(0, Compress(EncodeTestKeyframe({kMap, 0}))));
  EXPECT_FALSE(handler.TakeAck(2 * kSecond).value().journalled_seq.contains(old));
}

// An agent that is not ours may send what our uplink would refuse.
TEST_F(AgentHandlerTest, RefusesWhatCannotBeOfItsMap) {
  const auto send = [&](const KeyframeMessage& message) {
    return handler.OnPacket(WholeKeyframe(message.id.seq, Compress(EncodeMessage(message))));
  };
  EXPECT_EQ(send(ToMessage(TestKeyframe({kMap, 0}))), "");
  KeyframeMessage other = ToMessage(TestKeyframe({kMap, 1}));
  other.camera.fy += 100;
  EXPECT_EQ(send(other), "keyframe with another camera than its map's");
  other = ToMessage(TestKeyframe({kMap, 1}));
  other.utime = 1;
  EXPECT_EQ(send(other), "keyframe's time does not go forward with its seq");
  EXPECT_EQ(send(ToMessage(TestKeyframe({kMap, 1}))), "");
}

TEST_F(AgentHandlerTest, SendsTheNewestCorrectionUntilItIsConfirmed) {
  Correction correction;
  correction.map = kMap;
  for (const int revision : {3, 7, 5}) {
    correction.revision = revision;
    handler.OnCorrection(correction);
  }
  for (int i = 2; i < 6; ++i) {
    const auto ack = handler.TakeAck(i * kSecond);
    ASSERT_TRUE(ack);
    ASSERT_EQ(ack->corrections.size(), 1u);
    EXPECT_EQ(ack->corrections[0].revision, 7);
  }
  handler.OnPacket(HelloPacket({{kMap, 0, 7}}, 9));
  EXPECT_TRUE(handler.TakeAck(7 * kSecond)->corrections.empty());
  EXPECT_FALSE(handler.TakeAck(8 * kSecond));
}

// The agent's clock was set back: the map that it is in has a lower id than its earlier ones.
TEST_F(AgentHandlerTest, SendsTheCurrentMapsCorrectionFirst) {
  Correction correction;
  correction.revision = 1;
  for (int i = 0; i < 2 * kMaxLinkMaps; ++i) {
    correction.map = {1, 5000 + i};
    handler.OnCorrection(correction);
  }
  correction.map = kMap;
  handler.OnCorrection(correction);
  const auto ack = handler.TakeAck(2 * kSecond);
  ASSERT_TRUE(ack);
  ASSERT_EQ(ack->corrections.size(), 1u);
  EXPECT_EQ(ack->corrections[0].map, kMap);
}

PlaceMatch MatchOf(int32_t seq, int num_candidates) {
  PlaceMatch match;
  match.query = {kMap, seq};
  for (int i = 0; i < num_candidates; ++i) {
    match.candidates.push_back({{{2, 9}, i}, PlaceKind::kInter, 1.0f, {}});
  }
  return match;
}

TEST(JournalIndex, AKeyframeThatFillsAGapLacksItsMatch) {
  JournalIndex index;
  const auto add = [&index](int seq) {
    index.AddKeyframe({kMap, seq}, {seq, 1});
    index.Add(MatchOf(seq, 0), {100 + seq, 1});
  };
  add(0);
  add(3);
  EXPECT_FALSE(index.MissingMatches(kMap, 3));
  index.AddKeyframe({kMap, 1}, {1, 1});
  const auto gap = index.MissingMatches(kMap, 3);
  ASSERT_TRUE(gap);
  EXPECT_EQ(gap->from_seq, 1);
  add(1);
  EXPECT_FALSE(index.MissingMatches(kMap, 3));
}

TEST(JournalIndex, KnowsWhatIsOutstanding) {
  JournalIndex index;
  for (int seq = 0; seq < 6; ++seq) {
    index.AddKeyframe({kMap, seq}, {seq, 1});
  }
  EXPECT_EQ(index.Check(MatchOf(6, 0)), JournalIndex::Added::kUnknownKeyframe);
  for (const int seq : {0, 1, 4}) {
    EXPECT_EQ(index.Check(MatchOf(seq, 0)), JournalIndex::Added::kNew);
    index.Add(MatchOf(seq, seq == 1 ? 2 : 0), {100 + seq, 1});
    EXPECT_EQ(index.Check(MatchOf(seq, 0)), JournalIndex::Added::kRepeat);
  }
  auto gap = index.MissingMatches(kMap, 5);
  ASSERT_TRUE(gap);
  EXPECT_EQ(gap->from_seq, 2);
  EXPECT_EQ(gap->to_seq, 3);
  EXPECT_FALSE(index.MissingMatches(kMap, 1));
  EXPECT_EQ(index.num_missing_results(), 2);
  Constraint result;
  result.from = {{2, 9}, 0};
  result.to = {kMap, 1};
  const ResultNames outstanding = index.MissingResults(kMap, 5);
  ASSERT_EQ(outstanding.results.size(), 2u);
  EXPECT_THAT(outstanding.results, testing::Contains(std::pair(1, result.Id())));
  EXPECT_TRUE(index.MissingResults(kMap, 0).results.empty());
  EXPECT_TRUE(index.Find(outstanding).empty());
  EXPECT_EQ(index.Check(result), JournalIndex::Added::kNew);
  index.Add(result, {200, 1});
  EXPECT_EQ(index.Check(result), JournalIndex::Added::kRepeat);
  EXPECT_EQ(index.MissingResults(kMap, 5).results.size(), 1u);
  ASSERT_EQ(index.Find(outstanding).size(), 1u);
  EXPECT_EQ(index.Find(outstanding)[0].offset, 200);
  result.from.seq = 1;
  index.Add(result, {201, 1});
  EXPECT_TRUE(index.MissingResults(kMap, 5).results.empty());
  EXPECT_EQ(index.Find(JournalChannel::kConstraint, {kMap, 1}).size(), 2u);
}

// Nothing is asked on the first round (it may be on its way), then seldom, and ever more rarely
// while the same is missing.
TEST(OutstandingResults, AsksSeldomAndMoreSeldomWhileNothingComes) {
  JournalIndex index;
  for (int seq = 0; seq < 150; ++seq) {
    index.AddKeyframe({kMap, seq}, {seq, 1});
  }
  index.Add(MatchOf(140, 1), {1000, 1});
  OutstandingResults outstanding;
  const OutstandingResults::Requests at_first = outstanding.Due(index, kSecond);
  EXPECT_TRUE(at_first.matches.empty() && at_first.results.empty());
  index.AddKeyframe({kMap, 150}, {150, 1});
  std::vector<int64_t> asked_at, result_requested_at;
  for (int64_t s = 2; s <= 200; ++s) {
    const OutstandingResults::Requests requests = outstanding.Due(index, s * kSecond);
    for (const ResultNames& names : requests.results) {
      ASSERT_EQ(names.results.size(), 1u);
      EXPECT_EQ(names.results[0].first, 140);
      result_requested_at.push_back(s);
    }
    for (const SeqGap& gap : requests.matches) {
      EXPECT_EQ(gap.map, kMap);
      EXPECT_EQ(gap.from_seq, 0);
      EXPECT_EQ(gap.to_seq, 99) << "no more than so many at once";
      asked_at.push_back(s);
    }
  }
  EXPECT_THAT(asked_at, testing::ElementsAre(4, 7, 13, 25, 49, 97, 157));
  EXPECT_EQ(result_requested_at, asked_at);
  for (int seq = 0; seq < 140; ++seq) {
    index.Add(MatchOf(seq, 0), {2000 + seq, 1});
  }
  std::vector<int32_t> from;
  for (int64_t s = 201; s <= 230; ++s) {
    for (const SeqGap& gap : outstanding.Due(index, s * kSecond).matches) {
      from.push_back(gap.from_seq);
    }
  }
  EXPECT_THAT(from, testing::Each(141)) << "as soon as something came, it is asked anew";
  EXPECT_GE(from.size(), 2u);
}

// A verification result that was journalled before its match is not outstanding any more.
TEST(JournalIndex, AResultThatCameBeforeItsMatchIsNotMissing) {
  JournalIndex index;
  index.AddKeyframe({kMap, 0}, {});
  Constraint result;
  result.from = {{2, 9}, 0};
  result.to = {kMap, 0};
  index.Add(result, {});
  index.Add(MatchOf(0, 1), {});
  EXPECT_EQ(index.num_missing_results(), 0);
}

resend_request_t RequestOf(const std::string& requester, int32_t from, int32_t to) {
  resend_request_t request{};
  request.requester = requester;
  request.channel = "KEYFRAME_1";
  request.map = ToMessage(kMap);
  request.from_seq = from;
  request.to_seq = to;
  return request;
}

TEST(ResendQueue, AnswersInOrderAndDropsWhatIsCovered) {
  JournalIndex index;
  for (int seq = 0; seq < 6; ++seq) {
    index.AddKeyframe({kMap, seq}, {seq, 1});
  }
  ResendQueue queue;
  EXPECT_EQ(queue.Add(RequestOf("fusion", 1, 1'000'000'000), index), "");
  EXPECT_EQ(queue.Add(RequestOf("fusion", 2, 4), index), "");
  EXPECT_EQ(queue.Add(RequestOf("posegraph", 5, 5), index), "");
  EXPECT_EQ(queue.waiting(), 2u);
  std::vector<std::pair<std::string, int64_t>> answers;
  while (const auto answer = queue.Next(index)) {
    answers.emplace_back(answer->requester, answer->places.at(0).offset);
  }
  EXPECT_THAT(answers,
              testing::ElementsAre(testing::Pair("fusion", 1), testing::Pair("posegraph", 5),
                                   testing::Pair("fusion", 2), testing::Pair("fusion", 3),
                                   testing::Pair("fusion", 4), testing::Pair("fusion", 5)));
}

// A request for named verification results is answered with those that exist, and nothing else.
TEST(ResendQueue, AnswersWithTheRequestedResultsThatAreJournalled) {
  JournalIndex index;
  index.AddKeyframe({kMap, 0}, {});
  VerificationRequest request{"posegraph", {kMap, {}}};
  for (int seq = 0; seq < 4; ++seq) {
    Constraint result;
    result.from = {{2, 9}, seq};
    result.to = {kMap, 0};
    if (seq < 3) {
      index.Add(result, {100 + seq, 1});
    }
    if (seq > 1) {
      request.names.results.emplace_back(0, result.Id());
    }
  }
  ResendQueue queue;
  EXPECT_TRUE(queue.Add(request, index));
  const auto answer = queue.Next(index);
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->channel, "CONSTRAINT");
  ASSERT_EQ(answer->places.size(), 1u);
  EXPECT_EQ(answer->places[0].offset, 102);
  request.names.results.erase(request.names.results.begin());
  EXPECT_TRUE(queue.Add(request, index));
  EXPECT_EQ(queue.waiting(), 0u) << "what is still to be verified needs no answer";
}

TEST(ResendQueue, RefusesInvalidRequestsAndStaysBounded) {
  JournalIndex index;
  index.AddKeyframe({kMap, 0}, {});
  ResendQueue queue;
  EXPECT_NE(queue.Add(RequestOf("", 0, 0), index), "");
  EXPECT_NE(queue.Add(RequestOf("a b", 0, 0), index), "");
  EXPECT_NE(queue.Add(RequestOf(std::string(500, 'a'), 0, 0), index), "");
  EXPECT_NE(queue.Add(RequestOf("fusion", -1, 0), index), "");
  EXPECT_NE(queue.Add(RequestOf("fusion", 2, 1), index), "");
  resend_request_t other = RequestOf("fusion", 0, 0);
  other.channel = "STATUS_x";
  EXPECT_NE(queue.Add(other, index), "");
  for (int i = 0; i < 1000; ++i) {
    queue.Add(RequestOf(fmt::format("p{}", i), 0, 0), index);
  }
  EXPECT_EQ(queue.waiting(), ResendQueue::kMaxRequesters);
}

}  // namespace
}  // namespace pangea
