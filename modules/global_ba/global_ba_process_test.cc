#include "global_ba/global_ba_process.h"

#include <gtest/gtest.h>

#include "global_ba/ba_test_world.h"
#include "messages/channels.h"
#include "messages/encoding.h"
#include "messages/messages.h"
#include "pangea/resend_request_t.hpp"
#include "pangea/status_t.hpp"

namespace pangea {
namespace {

constexpr int64_t kTick = 100'000;

struct ServerOnBus {
  ServerOnBus() : process(bus, GlobalBaOptions{}) {
    bus.Subscribe("REFINEMENT", [this](const std::string&, Bytes data) {
      DecodeMessage(data, &refinements.emplace_back());
    });
    bus.Subscribe("RESEND_REQUEST", [this](const std::string&, Bytes data) {
      DecodeMessage(data, &requests.emplace_back());
    });
    bus.Subscribe("STATUS_global_ba",
                  [this](const std::string&, Bytes data) { DecodeMessage(data, &status); });
  }

  void Send(const Keyframe& keyframe) {
    PublishMessage(bus, channels::Keyframe(keyframe.id.map.agent_id), ToMessage(keyframe));
  }
  void SendAll(const BaTestMessages& messages) {
    for (const Keyframe& keyframe : messages.keyframes) {
      Send(keyframe);
    }
    for (const PlaceMatch& match : messages.matches) {
      PublishMessage(bus, "PLACE_MATCH", ToMessage(match));
    }
    for (const Constraint& constraint : messages.constraints) {
      PublishMessage(bus, "CONSTRAINT", ToMessage(constraint));
    }
    for (const map_state_t& chunk : ToMessages(messages.state)) {
      PublishMessage(bus, "MAP_STATE", chunk);
    }
    bus.Drain();
  }
  void Tick(int times) {
    for (int i = 0; i < times; ++i) {
      process.Tick(now += kTick);
      bus.Drain();
    }
  }

  LocalBus bus;
  GlobalBaProcess process;
  std::vector<map_state_t> refinements;
  std::vector<resend_request_t> requests;
  status_t status{};
  int64_t now = 0;
};

BaTestMessages SmallWorld() { return MessagesOf(MakeBaTestWorld({.keyframes = 8})); }

TEST(GlobalBaProcess, RefinesWhenItIsQuietAndOnlyOnce) {
  const BaTestMessages messages = SmallWorld();
  ServerOnBus server;
  server.SendAll(messages);
  server.Tick(25);
  EXPECT_EQ(server.status.pending, 1);
  EXPECT_TRUE(server.refinements.empty());
  server.Tick(60);
  ASSERT_EQ(server.refinements.size(), 1u);
  EXPECT_EQ(server.refinements[0].num_keyframes, 16);
  EXPECT_EQ(server.refinements[0].revision, messages.state.revision);
  server.Tick(60);
  EXPECT_EQ(server.refinements.size(), 1u);
  EXPECT_EQ(server.status.pending, 0);
}

TEST(GlobalBaProcess, WhoAsksForAStateGetsTheRefinementToo) {
  const BaTestMessages messages = SmallWorld();
  ServerOnBus server;
  server.SendAll(messages);
  const auto ask = [&](const MapId& map) {
    resend_request_t request{};
    request.requester = "map_points";
    request.channel = "MAP_STATE";
    request.map = ToMessage(map);
    PublishMessage(server.bus, "RESEND_REQUEST", request);
    server.bus.Drain();
  };
  ask(messages.state.maps[1]);  // there is none yet
  server.Tick(90);
  ASSERT_EQ(server.refinements.size(), 1u);
  for (const MapId& map : messages.state.maps) {
    ask(map);
  }
  ask({77, 7});
  server.Tick(1);
  ASSERT_EQ(server.refinements.size(), 2u);  // once per group
  EXPECT_EQ(EncodeMessage(server.refinements[1]), EncodeMessage(server.refinements[0]));
}

TEST(GlobalBaProcess, AMessagePutsItOff) {
  const BaTestMessages messages = SmallWorld();
  ServerOnBus server;
  server.SendAll(messages);
  Keyframe next = messages.keyframes.back();
  for (int i = 0; i < 5; ++i) {
    server.Tick(20);
    ++next.id.seq;
    server.Send(next);
    server.bus.Drain();
  }
  EXPECT_TRUE(server.refinements.empty());
  server.Tick(33);  // in the middle of it
  EXPECT_EQ(server.status.pending, 1);
  ++next.id.seq;
  server.Send(next);
  server.bus.Drain();
  server.Tick(90);
  EXPECT_EQ(server.refinements.size(), 1u);
  const auto dropped =
      std::ranges::find(server.status.counters, "adjustments_dropped", &counter_t::name);
  ASSERT_NE(dropped, server.status.counters.end());
  EXPECT_EQ(dropped->count, 1);
}

TEST(GlobalBaProcess, LiveAndReplayGiveTheSameBytes) {
  const BaTestMessages messages = SmallWorld();
  ServerOnBus live, replay;
  live.SendAll(messages);
  live.Tick(90);
  replay.SendAll(messages);
  replay.process.Finish();
  replay.bus.Drain();
  ASSERT_EQ(live.refinements.size(), 1u);
  ASSERT_EQ(replay.refinements.size(), 1u);
  for (int i = 0; i < live.refinements[0].num_keyframes; ++i) {
    EXPECT_EQ(live.refinements[0].keyframes[i].T_map_body.translation.x,
              replay.refinements[0].keyframes[i].T_map_body.translation.x);
  }
}

TEST(GlobalBaProcess, AsksForWhatItLacks) {
  BaTestMessages messages = SmallWorld();
  const Keyframe lost = messages.keyframes[3];
  messages.keyframes.erase(messages.keyframes.begin() + 3);
  ServerOnBus server;
  server.SendAll(messages);
  have_t have{};
  have.num_maps = 1;
  have.maps.push_back(ToMessage(lost.id.map));
  have.highest_seq.push_back(7);
  PublishMessage(server.bus, "HAVE", have);
  server.bus.Drain();
  server.Tick(25);
  ASSERT_GE(server.requests.size(), 2u);  // requested again without an answer
  EXPECT_EQ(server.requests[0].channel, "CONSTRAINT");
  EXPECT_EQ(server.requests[1].channel, "KEYFRAME_1");
  EXPECT_EQ(server.requests[1].from_seq, 3);
  EXPECT_EQ(server.requests[1].to_seq, 3);
  const size_t asked = server.requests.size();
  again_t again{};
  again.channel = "KEYFRAME_1";
  const KeyframeMessage message = ToMessage(lost);
  again.data = EncodeMessage(message);
  again.num_bytes = static_cast<int32_t>(again.data.size());
  PublishMessage(server.bus, "AGAIN_global_ba", again);
  server.bus.Drain();
  server.Tick(90);
  EXPECT_EQ(server.requests.size(), asked);
  ASSERT_EQ(server.refinements.size(), 1u);
  EXPECT_EQ(server.refinements[0].num_keyframes, 16);
}

TEST(GlobalBaProcess, RefusesWhatIsNotValid) {
  ServerOnBus server;
  PublishMessage(server.bus, "MAP_STATE", map_state_t{});
  PublishMessage(server.bus, "CONSTRAINT", constraint_t{});
  server.bus.Publish("KEYFRAME_1", std::vector<uint8_t>{1, 2, 3});
  server.bus.Drain();
  server.Tick(1);
  EXPECT_EQ(server.status.num_refused, 3);
}

}  // namespace
}  // namespace pangea
