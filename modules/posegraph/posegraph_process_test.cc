#include "posegraph/posegraph_process.h"

#include <dlfcn.h>
#include <gtest/gtest.h>

#include <atomic>
#include <limits>
#include <random>

#include "common/channels.h"
#include "common/messages.h"
#include "common/testing/synthetic_world.h"
#include "pangea/correction_t.hpp"
#include "pangea/map_state_t.hpp"
#include "pangea/resend_request_t.hpp"
#include "pangea/status_t.hpp"

namespace pangea {
namespace {

constexpr int64_t kTick = 100'000;

SyntheticWorld MakeWorld(int num_keyframes = 50) {
  SyntheticWorldOptions options;
  options.num_keyframes = num_keyframes;
  options.with_corners = false;
  return MakeSyntheticWorld(options);
}

std::vector<Constraint> MakeConstraints(const SyntheticWorld& world) {
  std::mt19937_64 random(5);
  std::vector<Constraint> constraints;
  for (const auto& [from, to] : OverlappingPairs(world, 1.0, 1000)) {
    if (to.seq % 4 == 0) {
      constraints.push_back(MakeTrueConstraint(world, from, to, {}, random));
    }
  }
  return constraints;
}

// Says that more waits when a test says so.
struct TestBus : LocalBus {
  bool MoreWaits() override { return more_waits; }
  bool more_waits = false;
};

// A server bus with the process on it, and all that it says.
struct Server {
  explicit Server(int64_t first_revision = 1) : process(bus, {}, first_revision) {
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
        DecodeMessage(data, &verdict_requests.emplace_back());
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
  std::vector<verdict_request_t> verdict_requests;
  std::vector<uint8_t> said;
  status_t status{};
  int64_t now = 0;
};

void SendAll(const SyntheticWorld& world, const std::vector<Constraint>& constraints,
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

// Ceres brings OpenMP into the process; this is how CHOLMOD's code asks it for four threads.
TEST(Process, SolvesInOneThreadWhateverALibraryAsksFor) {
  using Region = void (*)(void*);
  void* const symbol = dlsym(RTLD_DEFAULT, "GOMP_parallel");
  ASSERT_NE(symbol, nullptr);
  const auto parallel = reinterpret_cast<void (*)(Region, void*, unsigned, unsigned)>(symbol);
  std::atomic<int> entered = 0;
  const Region enter = [](void* count) { ++*static_cast<std::atomic<int>*>(count); };
  parallel(enter, &entered, 4, 0);
  EXPECT_EQ(entered.exchange(0), 4);
  UseOneThread();
  parallel(enter, &entered, 4, 0);
  EXPECT_EQ(entered, 1);
}

TEST(PoseGraphProcess, TellsEachAgentItsDriftAndTheMap) {
  const SyntheticWorld world = MakeWorld();
  Server server;
  SendAll(world, MakeConstraints(world), &server);
  server.Finish();
  ASSERT_FALSE(server.states.empty());
  EXPECT_EQ(server.states.back().num_maps, 2);
  EXPECT_EQ(server.states.back().num_keyframes, 100);
  ASSERT_GE(server.corrections.size(), 2u);
  EXPECT_TRUE(Parse(server.corrections.back()).value.has_value());
  int64_t revision = 0;
  for (const map_state_t& state : server.states) {
    EXPECT_GT(state.revision, revision);
    revision = state.revision;
    EXPECT_TRUE(Parse(state).value.has_value());
  }
  const size_t said = server.said.size();
  server.Finish();
  EXPECT_EQ(server.said.size(), said);
}

TEST(PoseGraphProcess, TakesWhatWaitsBeforeItSolves) {
  const SyntheticWorld world = MakeWorld(30);
  const std::vector<Constraint> constraints = MakeConstraints(world);
  ASSERT_GT(constraints.size(), 10u);  // more than a merge needs
  Server server;
  server.bus.more_waits = true;
  for (const SyntheticAgent& agent : world.agents) {
    for (const Keyframe& keyframe : agent.keyframes) {
      server.Send(keyframe);
    }
  }
  for (size_t i = 0; i + 1 < constraints.size(); ++i) {
    server.Send(constraints[i]);
  }
  EXPECT_EQ(server.process.graph().counters().solves, 0);
  EXPECT_TRUE(server.corrections.empty());
  server.bus.more_waits = false;
  server.Tick(1);
  EXPECT_EQ(server.process.graph().counters().solves, 1);
  EXPECT_EQ(server.corrections.size(), 2u);
  // Messages without an end hold nothing up for ever.
  server.bus.more_waits = true;
  for (int i = 0; i < 100; ++i) {
    server.Send(constraints.back());
  }
  EXPECT_EQ(server.process.graph().counters().solves, 2);
}

TEST(PoseGraphProcess, TheSameMessagesGiveTheSameBytes) {
  const SyntheticWorld world = MakeWorld();
  Server a, b;
  for (Server* server : {&a, &b}) {
    SendAll(world, MakeConstraints(world), server);
    server->Finish();
  }
  EXPECT_EQ(a.said, b.said);
}

TEST(PoseGraphProcess, RepeatsAndDisorderChangeNothingInTheEnd) {
  const SyntheticWorld world = MakeWorld();
  const std::vector<Constraint> constraints = MakeConstraints(world);
  Server straight, messy;
  SendAll(world, constraints, &straight);
  straight.Finish();
  messy.Have(world);  // the order of the maps
  for (const Constraint& constraint : constraints) {
    messy.Send(constraint);
  }
  for (const SyntheticAgent& agent : world.agents) {
    for (size_t k = 0; k < agent.keyframes.size(); ++k) {
      messy.Send(agent.keyframes[k ^ 1]);
      messy.Send(agent.keyframes[k / 2]);
    }
  }
  for (const Constraint& constraint : constraints) {
    messy.Send(constraint);
  }
  messy.Finish();
  const map_state_t& a = straight.states.back();
  const map_state_t& b = messy.states.back();
  ASSERT_EQ(a.num_keyframes, b.num_keyframes);
  EXPECT_EQ(a.num_constraints, b.num_constraints);
  for (int i = 0; i < a.num_keyframes; ++i) {
    EXPECT_NEAR(a.keyframes[i].T_map_body.translation.x, b.keyframes[i].T_map_body.translation.x,
                1e-4);
  }
}

TEST(PoseGraphProcess, WhenNothingComesForASecondAllIsPublished) {
  const SyntheticWorld world = MakeWorld(13);
  Server server;
  for (const Keyframe& keyframe : world.agents[0].keyframes) {
    server.Send(keyframe);
  }
  server.Tick(1);
  EXPECT_EQ(server.states.back().num_keyframes, 10);
  EXPECT_EQ(server.status.pending, 1);
  server.Tick(25);
  EXPECT_EQ(server.states.back().num_keyframes, 13);
  EXPECT_EQ(server.status.pending, 0);
  const size_t states = server.states.size();
  server.Tick(25);
  EXPECT_EQ(server.states.size(), states);
}

TEST(PoseGraphProcess, AsksForGapsAndTakesTheAnswers) {
  const SyntheticWorld world = MakeWorld(10);
  const std::vector<Keyframe>& keyframes = world.agents[0].keyframes;
  Server server;
  for (const int seq : {0, 1, 2, 6, 7}) {
    server.Send(keyframes[seq]);
  }
  server.Tick(12);
  ASSERT_FALSE(server.requests.empty());
  EXPECT_EQ(server.requests[0].channel, "KEYFRAME_1");
  EXPECT_EQ(server.requests[0].requester, "posegraph");
  EXPECT_EQ(server.requests[0].from_seq, 3);
  EXPECT_EQ(server.requests[0].to_seq, 5);
  for (const int seq : {3, 4, 5}) {
    const keyframe_t message = ToMessage(keyframes[seq]);
    again_t again{};
    again.channel = "KEYFRAME_1";
    again.data = EncodeMessage(message);
    again.num_bytes = static_cast<decltype(again.num_bytes)>(again.data.size());
    PublishMessage(server.bus, "AGAIN_posegraph", again);
  }
  server.bus.Drain();
  server.Tick(25);
  EXPECT_EQ(server.states.back().num_keyframes, 8);
  EXPECT_EQ(server.status.pending, 0);
}

TEST(PoseGraphProcess, AGapThatNobodyFillsIsBridged) {
  const SyntheticWorld world = MakeWorld(10);
  Server server;
  for (const int seq : {0, 1, 2, 5, 6}) {
    server.Send(world.agents[0].keyframes[seq]);
  }
  server.Tick(400);
  EXPECT_EQ(server.states.back().num_keyframes, 5);
  EXPECT_EQ(server.status.dropped, 2);
  EXPECT_EQ(server.process.graph().counters().bridged, 1);
}

TEST(PoseGraphProcess, AsksForVerdictsThatWerePromised) {
  const SyntheticWorld world = MakeWorld(10);
  Server server;
  PlaceMatch match;
  match.query = world.agents[1].keyframes[3].id;
  match.candidates.push_back({world.agents[0].keyframes[5].id, PlaceKind::kInter, 0.5f, {}});
  for (int seq = 0; seq < 3; ++seq) {
    PlaceMatch before;
    before.query = {match.query.map, seq};
    PublishMessage(server.bus, "PLACE_MATCH", ToMessage(before));
  }
  PublishMessage(server.bus, "PLACE_MATCH", ToMessage(match));
  server.bus.Drain();
  server.Tick(15);
  EXPECT_TRUE(server.verdict_requests.empty());
  Constraint refused;
  refused.from = match.candidates[0].match;
  refused.to = match.query;
  refused.reason = "too few inliers";
  server.Tick(10);
  ASSERT_EQ(server.verdict_requests.size(), 1u);
  EXPECT_EQ(server.verdict_requests[0].seq, std::vector<int32_t>{3});
  EXPECT_EQ(server.verdict_requests[0].constraint_id, std::vector<int64_t>{refused.Id()});
  server.Tick(650);  // it may take its time: asked for ever more rarely
  EXPECT_EQ(server.verdict_requests.size(), 5u);
  server.Send(refused);
  server.Tick(700);
  EXPECT_EQ(server.verdict_requests.size(), 5u);
  EXPECT_TRUE(server.requests.empty());
}

TEST(PoseGraphProcess, AfterARestartItAsksForWhatTheJournalHas) {
  const SyntheticWorld world = MakeWorld(10);
  Server server(1'000'000);
  server.Have(world);
  server.Tick(12);
  int verdicts = 0, keyframes = 0;
  for (const resend_request_t& request : server.requests) {
    verdicts += request.channel == "CONSTRAINT" ? 1 : 0;
    keyframes += request.channel.starts_with("KEYFRAME_") ? 1 : 0;
  }
  EXPECT_EQ(verdicts, 2);
  EXPECT_EQ(keyframes, 2);
  EXPECT_EQ(server.status.pending, 20 + 2);  // keyframes, and both maps' matches
  // Half of it says nothing of the whole.
  for (const Keyframe& keyframe : world.agents[0].keyframes) {
    server.Send(keyframe);
  }
  server.Tick(20);
  EXPECT_TRUE(server.states.empty());
  for (const Keyframe& keyframe : world.agents[1].keyframes) {
    server.Send(keyframe);
  }
  for (const SyntheticAgent& agent : world.agents) {
    for (const Keyframe& keyframe : agent.keyframes) {
      PlaceMatch match;
      match.query = keyframe.id;
      PublishMessage(server.bus, "PLACE_MATCH", ToMessage(match));
    }
  }
  server.bus.Drain();
  server.Tick(12);
  ASSERT_FALSE(server.states.empty());
  EXPECT_EQ(server.states.front().revision, 1'000'000);
}

TEST(PoseGraphProcess, DoesNotWaitForWhatNobodyHas) {
  const SyntheticWorld world = MakeWorld(10);
  Server server;
  server.Have(world);
  for (const Keyframe& keyframe : world.agents[0].keyframes) {
    server.Send(keyframe);
  }
  server.Tick(45);
  EXPECT_TRUE(server.states.empty());
  server.Tick(10);
  EXPECT_FALSE(server.states.empty());
}

// Fusion is behind: its verdicts come slowly, one by one, and the journal does not have them.
TEST(PoseGraphProcess, DoesNotWaitForWhatIsStillToBeJudged) {
  const SyntheticWorld world = MakeWorld();
  Server server;
  server.Have(world);
  std::vector<Constraint> owed;
  for (const SyntheticAgent& agent : world.agents) {
    for (const Keyframe& keyframe : agent.keyframes) {
      PlaceMatch match;
      match.query = keyframe.id;
      if (&agent == &world.agents[1]) {
        Constraint& refused = owed.emplace_back();
        refused.from = world.agents[0].keyframes[0].id;
        refused.to = keyframe.id;
        refused.kind = PlaceKind::kInter;
        refused.reason = "too few inliers";
        match.candidates.push_back({refused.from, refused.kind, 0.5f, {}});
      }
      PublishMessage(server.bus, "PLACE_MATCH", ToMessage(match));
      server.Send(keyframe);
    }
  }
  ASSERT_GT(owed.size(), 12u);
  int seconds = 0;
  for (; seconds < 12 && server.states.empty(); ++seconds) {
    server.Send(owed[static_cast<size_t>(seconds)]);
    server.Tick(10);
  }
  EXPECT_GT(seconds, 4) << "the journal has time to answer";
  EXPECT_LT(seconds, 9);
}

TEST(PoseGraphProcess, WhoComesLateIsToldTheStateAgain) {
  const SyntheticWorld world = MakeWorld();
  Server server;
  SendAll(world, MakeConstraints(world), &server);
  server.Finish();
  const map_state_t before = server.states.back();
  const size_t corrections = server.corrections.size();
  resend_request_t request{};
  request.requester = "global_ba";
  request.channel = "MAP_STATE";
  request.map = ToMessage(world.agents[1].map);
  PublishMessage(server.bus, "RESEND_REQUEST", request);
  server.bus.Drain();
  const map_state_t& again = server.states.back();
  EXPECT_GT(again.revision, before.revision);
  EXPECT_EQ(again.num_keyframes, before.num_keyframes);
  EXPECT_EQ(again.keyframes.back().T_map_body.translation.x,
            before.keyframes.back().T_map_body.translation.x);
  EXPECT_EQ(server.corrections.size(), corrections + 2);
}

// It would ask for two thousand million verdicts, and never come to an end.
TEST(PoseGraphProcess, AnAbsurdHaveIsRefused) {
  Server server;
  have_t have{};
  have.num_maps = 1;
  have.maps = {ToMessage(MapId{1, 100})};
  have.highest_seq = {std::numeric_limits<int32_t>::max()};
  PublishMessage(server.bus, "HAVE", have);
  server.bus.Drain();
  server.Tick(20);
  EXPECT_TRUE(server.requests.empty());
  ASSERT_EQ(server.status.num_refused, 1);
  EXPECT_EQ(server.status.refused[0].name, "have: invalid map or seq");
}

TEST(PoseGraphProcess, RefusesWhatIsNotValid) {
  Server server;
  constraint_t constraint{};
  PublishMessage(server.bus, "CONSTRAINT", constraint);
  server.bus.Publish("KEYFRAME_1", std::vector<uint8_t>{1, 2, 3});
  server.bus.Drain();
  server.Tick(1);
  EXPECT_EQ(server.status.num_refused, 2);
}

}  // namespace
}  // namespace pangea
