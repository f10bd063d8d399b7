#include "fusion/fusion_process.h"

#include <gtest/gtest.h>

#include "inter_map_ba/inter_map_ba_process.h"
#include "loop_verification/loop_verification_test_world.h"
#include "messages/channels.h"
#include "messages/encoding.h"
#include "messages/messages.h"
#include "pangea/resend_request_t.hpp"
#include "pangea/status_t.hpp"

namespace pangea {
namespace {

constexpr int64_t kSecond = 1'000'000;

// Two agents in one room on a LocalBus with both processes; their messages are recorded.
class VerificationProcesses : public testing::Test {
 protected:
  VerificationProcesses() {
    TestAgentOptions first, second;
    first.num_keyframes = 12;
    second.map = {2, 2000};
    second.radius = 2.3;
    second.start_angle = 0.15;
    second.num_keyframes = 12;
    const auto room = MakeTestRoom({.seed = 5});
    agent_m_ = RunTestAgent(room, first);
    agent_c_ = RunTestAgent(room, second);
    listener_.Subscribe<constraint_t>(std::string(channels::kConstraint),
                                      [this](const std::string&, const constraint_t& message) {
                                        constraints_.push_back(*Parse(message).value);
                                      });
    listener_.Subscribe<resend_request_t>(
        std::string(channels::kResendRequest),
        [this](const std::string&, const resend_request_t& message) {
          requests_.push_back(message);
        });
    listener_.Subscribe<status_t>(
        channels::Status("fusion"),
        [this](const std::string&, const status_t& message) { status_ = message; });
  }

  void SendKeyframes(const TestAgent& agent, int begin, int end) {
    for (int k = begin; k < end; ++k) {
      const Keyframe& keyframe = agent.keyframes[k];
      PublishMessage(bus_, channels::Keyframe(keyframe.id.map.agent_id), ToMessage(keyframe));
      bus_.Drain();
    }
  }
  void SendMatch(PlaceKind kind) {
    PlaceMatch match{
        agent_c_.keyframes[9].id, {MakeTestCandidate(agent_c_, 9, agent_m_, 10, 40, 10)}, {}};
    match.candidates[0].kind = kind;
    PublishMessage(bus_, std::string(channels::kPlaceMatch), ToMessage(match));
    bus_.Drain();
  }

  LocalBus bus_;
  FusionProcess fusion_{bus_, LoopVerifierOptions{}};
  InterMapBaProcess inter_map_ba_{bus_, LoopVerifierOptions{}};
  Node listener_{bus_, "listener"};
  TestAgent agent_m_, agent_c_;
  std::vector<Constraint> constraints_;
  std::vector<resend_request_t> requests_;
  status_t status_{};
};

TEST_F(VerificationProcesses, OneResultFromTheProcessOfItsKind) {
  SendKeyframes(agent_m_, 0, 12);
  SendKeyframes(agent_c_, 0, 12);
  SendMatch(PlaceKind::kInter);
  SendMatch(PlaceKind::kInter);  // a repeat gives no second verification result
  ASSERT_EQ(constraints_.size(), 1u);
  EXPECT_TRUE(constraints_[0].accepted) << constraints_[0].reason;
  EXPECT_EQ(constraints_[0].from, agent_m_.keyframes[10].id);
  EXPECT_EQ(constraints_[0].to, agent_c_.keyframes[9].id);
  EXPECT_EQ(constraints_[0].kind, PlaceKind::kInter);
}

// Also within one map: by fusion alone. These keyframes see no tag.
TEST_F(VerificationProcesses, CandidatesByATagGoToFusion) {
  SendKeyframes(agent_m_, 0, 12);
  SendKeyframes(agent_c_, 0, 12);
  SendMatch(PlaceKind::kTag);
  ASSERT_EQ(constraints_.size(), 1u);
  EXPECT_EQ(constraints_[0].kind, PlaceKind::kTag);
  EXPECT_EQ(constraints_[0].reason, "no alignment by a common tag");
}

// A later keyframe with an id that exists already changes nothing.
TEST_F(VerificationProcesses, AKeyframeIsTakenOnce) {
  SendKeyframes(agent_m_, 0, 12);
  SendKeyframes(agent_c_, 0, 12);
  TestAgent repeated = agent_c_;
  repeated.keyframes[9].points.clear();
  repeated.keyframes[9].corners.clear();
  SendKeyframes(repeated, 9, 10);
  SendMatch(PlaceKind::kInter);
  ASSERT_EQ(constraints_.size(), 1u);
  EXPECT_TRUE(constraints_[0].accepted) << constraints_[0].reason;
}

// The journal's owner gets the results it names retransmitted if they were sent; there is no answer
// for candidates that are still to be verified.
TEST_F(VerificationProcesses, RetransmitsAResultThatTheJournalLacks) {
  std::vector<Constraint> again;
  listener_.Subscribe<again_t>(
      "AGAIN_agent_handler", [&](const std::string&, const again_t& message) {
        EXPECT_EQ(message.channel, "CONSTRAINT");
        TakeRetransmission<constraint_t>(
            listener_, message, [&](const Constraint& result) { again.push_back(result); });
      });
  Constraint wanted;
  wanted.from = agent_m_.keyframes[10].id;
  wanted.to = agent_c_.keyframes[9].id;
  wanted.kind = PlaceKind::kInter;
  const auto ask = [&](const std::string& requester, int64_t id) {
    verdict_request_t request{};
    request.requester = requester;
    request.map = ToMessage(wanted.to.map);
    request.num_verdicts = 1;
    request.seq = {wanted.to.seq};
    request.constraint_id = {id};
    PublishMessage(bus_, "VERDICT_REQUEST", request);
    bus_.Drain();
  };
  SendKeyframes(agent_m_, 0, 12);
  SendMatch(PlaceKind::kInter);
  ask("agent_handler", wanted.Id());
  EXPECT_TRUE(again.empty()) << "still to be verified";
  SendKeyframes(agent_c_, 0, 12);
  ask("agent_handler", wanted.Id() + 1);
  ask("posegraph", wanted.Id());  // whom the journal's owner answers
  EXPECT_TRUE(again.empty());
  ask("agent_handler", wanted.Id());
  ASSERT_EQ(again.size(), 1u);
  EXPECT_EQ(again[0].Id(), wanted.Id());
}

TEST_F(VerificationProcesses, IntraOfTwoMapsIsRefusedByInterMapBa) {
  SendKeyframes(agent_m_, 0, 12);
  SendKeyframes(agent_c_, 0, 12);
  SendMatch(PlaceKind::kIntra);
  ASSERT_EQ(constraints_.size(), 1u);
  EXPECT_FALSE(constraints_[0].accepted);
  EXPECT_EQ(constraints_[0].reason, "intra, but of two maps");
}

// The verification result is the same whether the match comes after the keyframes, before them, or
// before keyframes that come in another order.
TEST_F(VerificationProcesses, ResultDoesNotDependOnArrival) {
  SendMatch(PlaceKind::kInter);
  SendKeyframes(agent_c_, 4, 12);
  SendKeyframes(agent_m_, 9, 12);
  EXPECT_TRUE(constraints_.empty());
  fusion_.Tick(kSecond);
  bus_.Drain();
  EXPECT_EQ(status_.pending, 1);
  SendKeyframes(agent_m_, 0, 9);
  SendKeyframes(agent_c_, 0, 4);
  ASSERT_EQ(constraints_.size(), 1u);

  LoopVerifier fusion{LoopVerifierOptions{}};
  for (const TestAgent* agent : {&agent_c_, &agent_m_}) {
    for (const Keyframe& keyframe : agent->keyframes) {
      // As it comes off the wire, where pixels are rounded.
      fusion.Add(*Parse(ToMessage(keyframe)).value);
    }
  }
  PlaceCandidate candidate = MakeTestCandidate(agent_c_, 9, agent_m_, 10, 40, 10);
  const Constraint direct = fusion.Verify(agent_c_.keyframes[9].id, candidate);
  EXPECT_EQ(direct.T_from_to.t, constraints_[0].T_from_to.t);
  EXPECT_TRUE(direct.covariance.isApprox(constraints_[0].covariance, 1e-12));
}

TEST_F(VerificationProcesses, AsksForAGapThatStays) {
  SendKeyframes(agent_m_, 0, 3);
  SendKeyframes(agent_m_, 5, 8);
  fusion_.Tick(10 * kSecond);
  bus_.Drain();
  EXPECT_TRUE(requests_.empty());  // it may be on its way
  fusion_.Tick(12 * kSecond);
  bus_.Drain();
  ASSERT_EQ(requests_.size(), 1u);
  EXPECT_EQ(requests_[0].requester, "fusion");
  EXPECT_EQ(requests_[0].channel, "KEYFRAME_1");
  EXPECT_EQ(requests_[0].from_seq, 3);
  EXPECT_EQ(requests_[0].to_seq, 4);

  // The answer closes it.
  for (int k = 3; k < 5; ++k) {
    const KeyframeMessage keyframe = ToMessage(agent_m_.keyframes[k]);
    again_t again{};
    again.channel = "KEYFRAME_1";
    again.data = EncodeMessage(keyframe);
    again.num_bytes = static_cast<int32_t>(again.data.size());
    PublishMessage(bus_, channels::Again("fusion"), again);
  }
  bus_.Drain();
  fusion_.Tick(20 * kSecond);
  bus_.Drain();
  fusion_.Tick(30 * kSecond);
  bus_.Drain();
  EXPECT_EQ(requests_.size(), 1u);
}

TEST_F(VerificationProcesses, AfterARestartKnownResultsAreNotRepeated) {
  have_t have{};
  have.num_maps = 1;
  have.maps = {ToMessage(agent_c_.keyframes[0].id.map)};
  have.highest_seq = {11};
  PublishMessage(bus_, std::string(channels::kHave), have);
  bus_.Drain();
  ASSERT_EQ(requests_.size(), 2u);  // each process its own
  EXPECT_EQ(requests_[0].channel, channels::kConstraint);
  EXPECT_EQ(requests_[0].to_seq, 11);

  Constraint known;
  known.from = agent_m_.keyframes[10].id;
  known.to = agent_c_.keyframes[9].id;
  known.kind = PlaceKind::kInter;
  const constraint_t message = ToMessage(known);
  again_t again{};
  again.channel = channels::kConstraint;
  again.data = EncodeMessage(message);
  again.num_bytes = static_cast<int32_t>(again.data.size());
  PublishMessage(bus_, channels::Again("fusion"), again);
  bus_.Drain();
  SendKeyframes(agent_m_, 0, 12);
  SendKeyframes(agent_c_, 0, 12);
  SendMatch(PlaceKind::kInter);
  EXPECT_TRUE(constraints_.empty());
}

// Results of former runs are known: a candidate near them is redundant.
TEST_F(VerificationProcesses, BesideVerifiedOnesACandidateIsRedundant) {
  SendKeyframes(agent_m_, 0, 12);
  SendKeyframes(agent_c_, 0, 12);
  Constraint known;
  known.to = agent_c_.keyframes[8].id;
  known.kind = PlaceKind::kInter;
  known.accepted = true;
  known.covariance *= 0.02 * 0.02;
  for (int i = 0; i < KnownConstraintOptions{}.min_between_maps; ++i) {
    known.from = agent_m_.keyframes[i].id;
    Retransmit(listener_, "fusion", std::string(channels::kConstraint), ToMessage(known));
  }
  bus_.Drain();
  SendMatch(PlaceKind::kInter);
  ASSERT_EQ(constraints_.size(), 1u);
  EXPECT_FALSE(constraints_[0].accepted);
  EXPECT_EQ(constraints_[0].reason, kRedundant);
}

// While both run, neither process learns the other's results; so it does not after a restart, when
// the journal has them all.
TEST_F(VerificationProcesses, ResultsOfTheOtherKindDecideNothing) {
  SendKeyframes(agent_c_, 0, 12);
  Constraint known;
  known.kind = PlaceKind::kIntra;
  known.accepted = true;
  known.covariance *= 0.02 * 0.02;
  for (int i = 0; i < KnownConstraintOptions{}.min_nearby; ++i) {
    known.from = agent_c_.keyframes[i / 2].id;
    known.to = agent_c_.keyframes[7 + i % 2].id;
    Retransmit(listener_, "fusion", std::string(channels::kConstraint), ToMessage(known));
  }
  bus_.Drain();
  const PlaceMatch match{
      agent_c_.keyframes[9].id, {{agent_c_.keyframes[0].id, PlaceKind::kInter, 0.5f, {}}}, {}};
  PublishMessage(bus_, std::string(channels::kPlaceMatch), ToMessage(match));
  bus_.Drain();
  ASSERT_EQ(constraints_.size(), 1u);
  EXPECT_NE(constraints_[0].reason, kRedundant);
}

// The first result of its map is pending: whether this one is redundant may depend on it.
TEST_F(VerificationProcesses, ACandidateWaitsForThoseThatItRestsOn) {
  SendKeyframes(agent_m_, 0, 12);
  SendKeyframes(agent_c_, 1, 12);
  const PlaceMatch early{
      agent_c_.keyframes[0].id, {MakeTestCandidate(agent_c_, 0, agent_m_, 10, 40, 10)}, {}};
  PublishMessage(bus_, std::string(channels::kPlaceMatch), ToMessage(early));
  bus_.Drain();
  SendMatch(PlaceKind::kInter);
  EXPECT_TRUE(constraints_.empty());
  SendKeyframes(agent_c_, 0, 1);
  ASSERT_EQ(constraints_.size(), 2u);
  EXPECT_EQ(constraints_[0].to.seq, 0);
  EXPECT_EQ(constraints_[1].to.seq, 9);
}

// Lost keyframes are not waited for: the windows end there.
TEST_F(VerificationProcesses, WhatIsLostIsNotWaitedFor) {
  SendKeyframes(agent_m_, 4, 12);
  SendKeyframes(agent_c_, 3, 12);
  SendMatch(PlaceKind::kInter);
  EXPECT_TRUE(constraints_.empty());
  have_t have{};
  for (const auto& [agent, lost] : {std::pair(&agent_m_, 3), std::pair(&agent_c_, 2)}) {
    have.gaps.emplace_back();
    have.gaps.back().map = ToMessage(agent->keyframes[0].id.map);
    have.gaps.back().to_seq = lost;
  }
  have.num_gaps = 2;
  PublishMessage(bus_, std::string(channels::kHave), have);
  bus_.Drain();
  ASSERT_EQ(constraints_.size(), 1u);
  EXPECT_TRUE(constraints_[0].accepted) << constraints_[0].reason;
}

// Live: all received candidates are known and reported as pending before they are verified. A
// candidate is verified after those that it depends on, and messages are handled between two
// verifications.
TEST(FusionProcess, LiveItListensBeforeItVerifies) {
  const auto room = MakeTestRoom({.seed = 5});
  TestAgentOptions first, second;
  first.num_keyframes = second.num_keyframes = 12;
  second.map = {2, 2000};
  second.radius = 2.3;
  const TestAgent agent_m = RunTestAgent(room, first);
  const TestAgent agent_c = RunTestAgent(room, second);
  LcmBus bus("memq://");
  FusionProcess fusion(bus, LoopVerifierOptions{});
  Node listener(bus, "listener");
  status_t status{};
  std::vector<int32_t> verified;
  listener.Subscribe<status_t>("STATUS_fusion",
                               [&](const std::string&, const status_t& said) { status = said; });
  listener.Subscribe<constraint_t>(
      "CONSTRAINT",
      [&](const std::string&, const constraint_t& result) { verified.push_back(result.to.seq); });
  for (const TestAgent* agent : {&agent_m, &agent_c}) {
    for (const Keyframe& keyframe : agent->keyframes) {
      PublishMessage(bus, channels::Keyframe(keyframe.id.map.agent_id), ToMessage(keyframe));
    }
  }
  for (const int seq : {11, 11, 9, 10}) {  // one comes twice
    const PlaceMatch match{
        agent_c.keyframes[seq].id, {MakeTestCandidate(agent_c, seq, agent_m, 10, 40, 10)}, {}};
    PublishMessage(bus, "PLACE_MATCH", ToMessage(match));
  }
  while (bus.MoreWaits()) {
    bus.Handle(0);
  }
  EXPECT_TRUE(verified.empty());
  fusion.Tick(kSecond);
  bus.Handle(0);
  EXPECT_EQ(status.pending, 3);
  bus.Handle(0);  // one verification result
  fusion.Tick(2 * kSecond);
  bus.Handle(0);
  bus.Handle(0);
  EXPECT_EQ(status.pending, 2);
  while (bus.Handle(0)) {
  }
  EXPECT_EQ(verified, (std::vector<int32_t>{9, 10, 11}));
}

// Two agents that walk at once: candidates in both directions, far more than one thread's turn.
std::vector<std::vector<uint8_t>> ResultsWith(int threads) {
  const auto room = MakeTestRoom({.seed = 5});
  TestAgentOptions first, second;
  first.num_keyframes = second.num_keyframes = 12;
  second.map = {2, 2000};
  second.radius = 2.3;
  const TestAgent agents[] = {RunTestAgent(room, first), RunTestAgent(room, second)};
  LcmBus bus("memq://");
  LoopVerifierOptions options;
  options.redundancy.min_between_maps = 2;  // so that some rest on others
  FusionProcess fusion(bus, options, nullptr, {}, threads);
  Node listener(bus, "listener");
  std::vector<std::vector<uint8_t>> results;
  listener.SubscribeBytes("CONSTRAINT", [&](const std::string&, Bytes data) {
    results.emplace_back(data.begin(), data.end());
  });
  for (int k = 0; k < 12; ++k) {
    for (const int query : {0, 1}) {
      const TestAgent& agent = agents[query];
      const TestAgent& other = agents[1 - query];
      const Keyframe& keyframe = agent.keyframes[k];
      PublishMessage(bus, channels::Keyframe(keyframe.id.map.agent_id), ToMessage(keyframe));
      PlaceMatch match{keyframe.id, {}, {}};
      for (int m = std::max(0, k - 2); m < k + query; ++m) {
        match.candidates.push_back(MakeTestCandidate(agent, k, other, m, 40, 10));
        match.candidates.back().kind = PlaceKind::kInter;
      }
      PublishMessage(bus, "PLACE_MATCH", ToMessage(match));
    }
    // Some messages come between two verifications.
    for (int i = 0; i < 5; ++i) {
      bus.Handle(0);
    }
  }
  while (bus.Handle(0)) {
  }
  return results;
}

TEST(FusionProcess, TheNumberOfThreadsChangesNoByte) {
  const auto of_one = ResultsWith(1);
  EXPECT_GT(of_one.size(), 40u);
  EXPECT_TRUE(ResultsWith(2) == of_one);
  EXPECT_TRUE(ResultsWith(4) == of_one);
}

TEST_F(VerificationProcesses, ACornerThatDoesNotExistIsRefused) {
  SendKeyframes(agent_m_, 0, 12);
  SendKeyframes(agent_c_, 0, 12);
  PlaceMatch match{
      agent_c_.keyframes[9].id, {MakeTestCandidate(agent_c_, 9, agent_m_, 10, 40, 10)}, {}};
  match.candidates[0].corner_matches[0].second = kMaxCorners - 1;
  PublishMessage(bus_, std::string(channels::kPlaceMatch), ToMessage(match));
  bus_.Drain();
  ASSERT_EQ(constraints_.size(), 1u);
  EXPECT_FALSE(constraints_[0].accepted);
}

}  // namespace
}  // namespace pangea
