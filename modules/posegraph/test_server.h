#pragma once

// For tests: a pose graph process on an in-process bus.

#include <gtest/gtest.h>

#include <optional>
#include <random>

#include "core/testing/synthetic_world.h"
#include "messages/channels.h"
#include "messages/encoding.h"
#include "messages/messages.h"
#include "pangea/correction_t.hpp"
#include "pangea/map_state_t.hpp"
#include "pangea/resend_request_t.hpp"
#include "pangea/status_t.hpp"
#include "posegraph/posegraph_process.h"

namespace pangea {

inline constexpr int64_t kTick = 100'000;

inline SyntheticWorld MakeWorld(int num_keyframes = 50) {
  SyntheticWorldOptions options;
  options.num_keyframes = num_keyframes;
  options.with_corners = false;
  return MakeSyntheticWorld(options);
}

inline std::vector<Constraint> MakeConstraints(const SyntheticWorld& world) {
  std::mt19937_64 random(5);
  std::vector<Constraint> constraints;
  for (const auto& [from, to] : OverlappingPairs(world, 1.0, 1000)) {
    if (to.seq % 4 == 0) {
      constraints.push_back(MakeTrueConstraint(world, from, to, {}, random));
    }
  }
  return constraints;
}

// A bus on which a test sets whether more messages wait.
struct TestBus : LocalBus {
  bool MoreWaits() override { return more_waits; }
  bool more_waits = false;
};

// A server bus with the process, and all messages that the process publishes.
struct Server {
  explicit Server(std::optional<int64_t> start_utime = {}) : process(bus, {}, start_utime) {
    bus.Subscribe(".*", [this](const std::string& channel, Bytes data) {
      if (channel == "MAP_STATE") {
        DecodeMessage(data, &states.emplace_back());
        said.insert(said.end(), data.begin(), data.end());
      } else if (channel.starts_with("CORRECTION_")) {
        DecodeMessage(data, &corrections.emplace_back());
        EXPECT_EQ(channel, channels::Correction(corrections.back().map.agent_id));
      } else if (channel == "RESEND_REQUEST") {
        DecodeMessage(data, &requests.emplace_back());
      } else if (channel == "VERDICT_REQUEST") {
        DecodeMessage(data, &verification_requests.emplace_back());
      } else if (channel == "STATUS_posegraph") {
        DecodeMessage(data, &status);
      }
    });
  }
  void Send(const Keyframe& keyframe) {
    PublishMessage(bus, channels::Keyframe(keyframe.id.map.agent_id), ToMessage(keyframe));
    bus.Drain();
  }
  void Send(const Constraint& constraint) {
    PublishMessage(bus, "CONSTRAINT", ToMessage(constraint));
    bus.Drain();
  }
  void Have(const SyntheticWorld& world) {
    have_t have{};
    for (const SyntheticAgent& agent : world.agents) {
      have.maps.push_back(ToMessage(agent.map));
      have.highest_seq.push_back(agent.keyframes.back().id.seq);
    }
    have.num_maps = static_cast<int16_t>(have.maps.size());
    PublishMessage(bus, "HAVE", have);
    bus.Drain();
  }
  void Tick(int times) {
    for (int i = 0; i < times; ++i) {
      process.Tick(now += kTick);
      bus.Drain();
    }
  }
  void Finish() {
    process.Finish();
    bus.Drain();
  }

  TestBus bus;
  PoseGraphProcess process;
  std::vector<map_state_t> states;
  std::vector<correction_t> corrections;
  std::vector<resend_request_t> requests;
  std::vector<verdict_request_t> verification_requests;
  std::vector<uint8_t> said;
  status_t status{};
  int64_t now = 0;
};

inline void SendAll(const SyntheticWorld& world, const std::vector<Constraint>& constraints,
                    Server* server) {
  for (size_t k = 0; k < world.agents[0].keyframes.size(); ++k) {
    for (const SyntheticAgent& agent : world.agents) {
      server->Send(agent.keyframes[k]);
    }
    for (const Constraint& constraint : constraints) {
      if (constraint.to.seq == static_cast<int>(k)) {
        server->Send(constraint);
      }
    }
  }
}

}  // namespace pangea
