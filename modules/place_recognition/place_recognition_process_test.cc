#include "place_recognition/place_recognition_process.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "messages/channels.h"
#include "messages/encoding.h"
#include "messages/messages.h"
#include "pangea/status_t.hpp"
#include "place_recognition/test_world.h"

namespace pangea {
namespace {

using test::kMapA;
using test::kMapB;
constexpr int kRound = 32;

using Payload = std::vector<uint8_t>;

template <typename Message>
Payload Encode(const Message& message) {
  Payload bytes(message.getEncodedSize());
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

std::vector<KeyframeMessage> Round(test::TestWorld& world, const MapId& map, int count) {
  std::vector<KeyframeMessage> keyframes;
  for (int seq = 0; seq < count; ++seq) {
    const double yaw = 2 * M_PI * seq / kRound;
    Keyframe keyframe = world.See({map, seq}, {2 * std::cos(yaw), 2 * std::sin(yaw), 1.5}, yaw);
    if (seq > 0) {
      keyframe.edge = OdometryEdge{seq - 1, {}, Matrix6d::Identity()};
    }
    keyframes.push_back(ToMessage(keyframe));
  }
  return keyframes;
}

// A server bus with the process, and all messages that it publishes.
struct Server {
  Server() : process(bus, {}) {
    bus.Subscribe("PLACE_MATCH", [this](const std::string&, Bytes data) {
      matches.emplace_back(data.begin(), data.end());
    });
    bus.Subscribe("RESEND_REQUEST", [this](const std::string&, Bytes data) {
      requests.emplace_back();
      ASSERT_TRUE(DecodeMessage(data, &requests.back()));
    });
    bus.Subscribe("STATUS_place_recognition", [this](const std::string&, Bytes data) {
      ASSERT_TRUE(DecodeMessage(data, &status));
    });
  }
  void Send(const KeyframeMessage& keyframe) {
    PublishMessage(bus, channels::Keyframe(keyframe.id.map.agent_id), keyframe);
    bus.Drain();
  }
  void Retransmit(const std::string& channel, const Payload& payload) {
    again_t again{};
    again.channel = channel;
    again.data.assign(payload.begin(), payload.end());
    again.num_bytes = static_cast<int32_t>(payload.size());
    PublishMessage(bus, "AGAIN_place_recognition", again);
    bus.Drain();
  }
  void Have(const std::vector<std::pair<MapId, int>>& maps) {
    have_t have{};
    for (const auto& [map, seq] : maps) {
      have.maps.push_back(ToMessage(map));
      have.highest_seq.push_back(seq);
    }
    have.num_maps = static_cast<int16_t>(maps.size());
    PublishMessage(bus, "HAVE", have);
    bus.Drain();
  }
  // Publishes a state in which these maps are one group.
  void Fused(const std::vector<MapId>& maps) {
    MapState state;
    state.group = maps.front();
    state.revision = 1;
    state.maps = maps;
    for (const map_state_t& chunk : ToMessages(state)) {
      PublishMessage(bus, "MAP_STATE", chunk);
    }
    bus.Drain();
  }
  void Tick() {
    process.Tick(now += 1'000'000);
    bus.Drain();
  }
  place_match_t Match(size_t i) const {
    place_match_t match{};
    EXPECT_TRUE(DecodeMessage(matches.at(i), &match));
    return match;
  }

  LocalBus bus;
  PlaceRecognitionProcess process;
  std::vector<Payload> matches;
  std::vector<resend_request_t> requests;
  status_t status{};
  int64_t now = 0;
};

TEST(PlaceRecognitionProcess, OneMatchPerKeyframeInOrderWhateverTheOrderAndRepeats) {
  test::TestWorld world(1);
  const auto keyframes = Round(world, kMapA, 8);
  Server straight;
  for (const KeyframeMessage& keyframe : keyframes) {
    straight.Send(keyframe);
  }
  Server shuffled;
  for (const int i : {0, 0, 2, 1, 3, 6, 6, 5, 4, 7, 1, 7}) {
    shuffled.Send(keyframes[i]);
  }
  ASSERT_EQ(straight.matches.size(), 8u);
  EXPECT_EQ(straight.matches, shuffled.matches);
  for (int i = 0; i < 8; ++i) {
    EXPECT_EQ(straight.Match(i).query.seq, i);
  }
}

TEST(PlaceRecognitionProcess, MatchesTwoMapsAndObeysTheGroups) {
  test::TestWorld world(2);
  Server server;
  const auto keyframes = Round(world, kMapA, kRound + 5);
  for (int i = 0; i < kRound + 4; ++i) {
    server.Send(keyframes[i]);
  }
  const auto keyframes_b = Round(world, kMapB, 2);
  server.Send(keyframes_b[0]);
  ASSERT_EQ(server.matches.size(), kRound + 5u);
  const place_match_t own = server.Match(kRound + 3);
  ASSERT_GT(own.num_candidates, 0);
  EXPECT_EQ(own.candidates[0].kind, place_candidate_t::KIND_INTRA);
  const place_match_t other = server.Match(kRound + 4);
  ASSERT_GT(other.num_candidates, 0);
  EXPECT_EQ(other.candidates[0].kind, place_candidate_t::KIND_INTER);
  server.Fused({kMapA, kMapB});
  server.Send(keyframes[kRound + 4]);
  const place_match_t in_group = server.Match(kRound + 5);
  ASSERT_GT(in_group.num_candidates, 0);
  for (const place_candidate_t& candidate : in_group.candidates) {
    EXPECT_EQ(candidate.kind, place_candidate_t::KIND_INTER);
  }
}

TEST(PlaceRecognitionProcess, AsksForAGapAndForALostTail) {
  test::TestWorld world(3);
  const auto keyframes = Round(world, kMapA, 4);
  Server server;
  server.Send(keyframes[0]);
  server.Send(keyframes[2]);
  server.Tick();
  EXPECT_TRUE(server.requests.empty());  // the message may be under way
  server.Tick();
  ASSERT_EQ(server.requests.size(), 1u);
  EXPECT_EQ(server.requests[0].channel, "KEYFRAME_1");
  EXPECT_EQ(server.requests[0].requester, "place_recognition");
  EXPECT_EQ(server.requests[0].from_seq, 1);
  EXPECT_EQ(server.requests[0].to_seq, 1);
  EXPECT_EQ(server.status.pending, 1);
  server.Retransmit("KEYFRAME_1", Encode(keyframes[1]));
  EXPECT_EQ(server.matches.size(), 3u);
  server.Have({{kMapA, 3}});
  server.Tick();
  server.Tick();
  ASSERT_EQ(server.requests.size(), 2u);
  EXPECT_EQ(server.requests[1].from_seq, 3);
  server.Retransmit("KEYFRAME_1", Encode(keyframes[3]));
  server.Tick();
  EXPECT_EQ(server.matches.size(), 4u);
  EXPECT_EQ(server.requests.size(), 2u);
  EXPECT_EQ(server.status.pending, 0);
}

TEST(PlaceRecognitionProcess, AGapBridgedByTheNextEdgeIsNotWaitedFor) {
  test::TestWorld world(4);
  auto keyframes = Round(world, kMapA, 5);
  Server server;
  server.Send(keyframes[0]);
  keyframes[4].edge_from_seq = 0;
  server.Send(keyframes[4]);
  server.Tick();
  ASSERT_EQ(server.matches.size(), 2u);
  EXPECT_EQ(server.Match(1).query.seq, 4);
  EXPECT_TRUE(server.requests.empty());
}

TEST(PlaceRecognitionProcess, AGapNamedByHaveIsNotWaitedFor) {
  test::TestWorld world(8);
  const auto keyframes = Round(world, kMapA, 4);
  Server server;
  server.Send(keyframes[0]);
  server.Send(keyframes[3]);
  EXPECT_EQ(server.matches.size(), 1u);
  have_t have{};
  have.num_maps = 1;
  have.maps.push_back(ToMessage(kMapA));
  have.highest_seq.push_back(3);
  have.num_gaps = 1;
  have.gaps.resize(1);
  have.gaps[0].map = ToMessage(kMapA);
  have.gaps[0].from_seq = 1;
  have.gaps[0].to_seq = 2;
  PublishMessage(server.bus, "HAVE", have);
  server.bus.Drain();
  EXPECT_EQ(server.matches.size(), 2u);
  server.Tick();
  EXPECT_TRUE(server.requests.empty());
}

TEST(PlaceRecognitionProcess, ARestartPublishesOnlyWhatTheJournalLacksAndMissesNoPair) {
  test::TestWorld world(5);
  const auto a = Round(world, kMapA, 4);
  const auto b = Round(world, kMapB, 4);
  Server before;
  for (int i = 0; i < 3; ++i) {
    before.Send(a[i]);
    before.Send(b[i]);
  }
  Server after;  // a#3 and b#3 arrived while it was down
  after.Have({{kMapA, 3}, {kMapB, 3}});
  after.Tick();
  ASSERT_EQ(after.requests.size(), 6u);
  EXPECT_EQ(after.requests[0].channel, "PLACE_MATCH");
  EXPECT_EQ(after.requests[1].channel, "KEYFRAME_1");
  EXPECT_EQ(after.requests[4].channel, "MAP_STATE");  // the groups decide the kind
  EXPECT_EQ(after.requests[5].channel, "MAP_STATE");
  for (const Payload& match : before.matches) {
    after.Retransmit("PLACE_MATCH", match);
  }
  for (const KeyframeMessage& keyframe : a) {
    after.Retransmit("KEYFRAME_1", Encode(keyframe));
  }
  EXPECT_TRUE(after.matches.empty());  // a#3 waits for map B
  for (const KeyframeMessage& keyframe : b) {
    after.Retransmit("KEYFRAME_2", Encode(keyframe));
  }
  EXPECT_TRUE(after.matches.empty());  // the groups are still to come
  after.Fused({kMapA});
  EXPECT_TRUE(after.matches.empty());
  after.Fused({kMapB});
  ASSERT_EQ(after.matches.size(), 2u);
  EXPECT_EQ(after.Match(0).query.seq, 3);
  EXPECT_GT(after.Match(0).num_candidates, 0);
  EXPECT_EQ(after.Match(1).query.seq, 3);
  EXPECT_GT(after.Match(1).num_candidates, 0);
}

// A day of several agents.
TEST(PlaceRecognitionProcess, ARestartKnowsEveryMatchOfALargeJournal) {
  constexpr int kMatches = 150'000;
  test::TestWorld world(5);
  Server server;
  server.Have({{kMapA, kMatches - 1}});
  PlaceMatch match;
  for (int seq = 0; seq < kMatches; ++seq) {
    match.query = {kMapA, seq};
    server.Retransmit("PLACE_MATCH", Encode(ToMessage(match)));
  }
  Keyframe last = world.See(match.query, {0, 0, 1.5}, 0);
  last.edge = OdometryEdge{0, {}, Matrix6d::Identity()};
  have_t have{};
  have.num_maps = 1;
  have.maps.push_back(ToMessage(kMapA));
  have.highest_seq.push_back(kMatches - 1);
  have.num_gaps = 1;
  have.gaps.resize(1);
  have.gaps[0].map = ToMessage(kMapA);
  have.gaps[0].to_seq = kMatches - 2;
  PublishMessage(server.bus, "HAVE", have);
  server.bus.Drain();
  server.Retransmit("KEYFRAME_1", Encode(ToMessage(last)));
  server.Fused({kMapA});
  EXPECT_TRUE(server.matches.empty());  // the journal has it
}

TEST(PlaceRecognitionProcess, AfterARestartTheKindsAreThoseOfTheGroups) {
  test::TestWorld world(9);
  const auto keyframes = Round(world, kMapA, kRound + 5);
  Server before;
  for (int i = 0; i < kRound + 4; ++i) {
    before.Send(keyframes[i]);
  }
  const auto restarted = [&](Server& after) {
    after.Have({{kMapA, kRound + 4}});
    after.Tick();
    for (const Payload& match : before.matches) {
      after.Retransmit("PLACE_MATCH", match);
    }
    for (const KeyframeMessage& keyframe : keyframes) {
      after.Retransmit("KEYFRAME_1", Encode(keyframe));
    }
    EXPECT_TRUE(after.matches.empty());
  };
  const auto kind = [](const Server& after) {
    EXPECT_EQ(after.matches.size(), 1u);
    EXPECT_GT(after.Match(0).num_candidates, 0);
    return after.Match(0).candidates.at(0).kind;
  };
  Server told;
  restarted(told);
  told.Fused({kMapA, kMapB});
  EXPECT_EQ(kind(told), place_candidate_t::KIND_INTER);
  Server alone;  // no process answers
  restarted(alone);
  for (int i = 0; i < 30; ++i) {
    alone.Tick();
  }
  EXPECT_EQ(kind(alone), place_candidate_t::KIND_INTRA);
}

TEST(PlaceRecognitionProcess, RetransmitsItsMatchesAsTheyWere) {
  test::TestWorld world(6);
  Server server;
  for (const KeyframeMessage& keyframe : Round(world, kMapA, 3)) {
    server.Send(keyframe);
  }
  std::vector<again_t> answers;
  server.bus.Subscribe("AGAIN_fusion", [&](const std::string&, Bytes data) {
    answers.emplace_back();
    ASSERT_TRUE(DecodeMessage(data, &answers.back()));
  });
  resend_request_t request{};
  request.requester = "fusion";
  request.channel = "PLACE_MATCH";
  request.map = ToMessage(kMapA);
  request.from_seq = 1;
  request.to_seq = 9;
  PublishMessage(server.bus, "RESEND_REQUEST", request);
  server.bus.Drain();
  ASSERT_EQ(answers.size(), 2u);
  EXPECT_EQ(Payload(answers[0].data.begin(), answers[0].data.end()), server.matches[1]);
}

// Live: messages that arrive meanwhile are handled between two keyframes.
TEST(PlaceRecognitionProcess, LiveItHearsBeforeItRecognises) {
  test::TestWorld world(8);
  LcmBus bus("memq://");
  PlaceRecognitionProcess process(bus, {});
  Node listener(bus, "listener");
  status_t status{};
  std::vector<int32_t> recognised;
  listener.Subscribe<status_t>("STATUS_place_recognition",
                               [&](const std::string&, const status_t& said) { status = said; });
  listener.Subscribe<place_match_t>("PLACE_MATCH",
                                    [&](const std::string&, const place_match_t& match) {
                                      recognised.push_back(match.query.seq);
                                    });
  for (const KeyframeMessage& keyframe : Round(world, kMapA, 4)) {
    PublishMessage(bus, "KEYFRAME_1", keyframe);
  }
  while (bus.MoreWaits()) {
    bus.Handle(0);
  }
  EXPECT_TRUE(recognised.empty());
  process.Tick(1'000'000);
  bus.Handle(0);
  EXPECT_EQ(status.pending, 4);
  while (bus.Handle(0)) {
  }
  EXPECT_EQ(recognised, (std::vector<int32_t>{0, 1, 2, 3}));
}

TEST(PlaceRecognitionProcess, GarbageIsCountedNotObeyed) {
  test::TestWorld world(7);
  Server server;
  auto keyframe = Round(world, kMapA, 1)[0];
  keyframe.camera.fx = NAN;
  server.Send(keyframe);
  const Payload junk(50, 0xAB);
  server.bus.Publish("KEYFRAME_1", junk);
  server.Retransmit("KEYFRAME_1", junk);
  server.Retransmit("PLACE_MATCH", junk);
  server.Tick();
  EXPECT_TRUE(server.matches.empty());
  EXPECT_GE(server.status.num_refused, 3);
}

}  // namespace
}  // namespace pangea
