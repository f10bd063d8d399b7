#include "posegraph/test_server.h"

namespace pangea {
namespace {

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
  // An endless stream of messages does not delay a solve for ever.
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

TEST(PoseGraphProcess, WhoComesLateGetsTheStateRetransmitted) {
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
