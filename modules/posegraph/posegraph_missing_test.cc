#include <limits>

#include "messages/encoding.h"
#include "posegraph/test_server.h"

// Missing messages: requested, waited for, or given up.

namespace pangea {
namespace {

TEST(PoseGraphMissing, AsksForGapsAndTakesTheAnswers) {
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
    const KeyframeMessage message = ToMessage(keyframes[seq]);
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

TEST(PoseGraphMissing, AGapThatNobodyFillsIsBridged) {
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

TEST(PoseGraphMissing, RequestsResultsThatWerePromised) {
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
  EXPECT_TRUE(server.verification_requests.empty());
  Constraint refused;
  refused.from = match.candidates[0].match;
  refused.to = match.query;
  refused.reason = "too few inliers";
  server.Tick(10);
  ASSERT_EQ(server.verification_requests.size(), 1u);
  EXPECT_EQ(server.verification_requests[0].seq, std::vector<int32_t>{3});
  EXPECT_EQ(server.verification_requests[0].constraint_id, std::vector<int64_t>{refused.Id()});
  server.Tick(650);  // verification may be slow: requested at growing intervals
  EXPECT_EQ(server.verification_requests.size(), 5u);
  server.Send(refused);
  server.Tick(700);
  EXPECT_EQ(server.verification_requests.size(), 5u);
  EXPECT_TRUE(server.requests.empty());
}

TEST(PoseGraphMissing, AfterARestartItAsksForWhatTheJournalHas) {
  const SyntheticWorld world = MakeWorld(10);
  Server server(1'000'000);
  server.Have(world);
  server.Tick(5);
  int results = 0, keyframes = 0;
  for (const resend_request_t& request : server.requests) {
    results += request.channel == "CONSTRAINT" ? 1 : 0;
    keyframes += request.channel.starts_with("KEYFRAME_") ? 1 : 0;
  }
  EXPECT_EQ(results, 2);
  EXPECT_EQ(keyframes, 2);
  EXPECT_EQ(server.status.pending, 20 + 2);  // keyframes, and both maps' matches
  // Nothing is published from half of the input.
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

TEST(PoseGraphMissing, DoesNotWaitForWhatNobodyHas) {
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

// Fusion is behind: its verification results come slowly, one by one, and are not in the journal.
TEST(PoseGraphMissing, DoesNotWaitForWhatIsStillToBeVerified) {
  const SyntheticWorld world = MakeWorld();
  Server server;
  server.Have(world);
  std::vector<Constraint> outstanding;
  for (const SyntheticAgent& agent : world.agents) {
    for (const Keyframe& keyframe : agent.keyframes) {
      PlaceMatch match;
      match.query = keyframe.id;
      if (&agent == &world.agents[1]) {
        Constraint& refused = outstanding.emplace_back();
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
  ASSERT_GT(outstanding.size(), 12u);
  int seconds = 0;
  for (; seconds < 12 && server.states.empty(); ++seconds) {
    server.Send(outstanding[static_cast<size_t>(seconds)]);
    server.Tick(10);
  }
  EXPECT_GT(seconds, 4) << "the journal has time to answer";
  EXPECT_LT(seconds, 9);
}

// Otherwise it would request two thousand million verification results and never end.
TEST(PoseGraphMissing, AnAbsurdHaveIsRefused) {
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

}  // namespace
}  // namespace pangea
