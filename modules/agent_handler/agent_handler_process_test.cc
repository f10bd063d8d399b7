#include "agent_handler/agent_handler_process.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <set>
#include <utility>

#include "agent_handler/link_test_world.h"
#include "bus/status_log.h"
#include "files/testing/full_disk.h"
#include "link/agent_key.h"
#include "log_file/log_writer.h"
#include "messages/encoding.h"
#include "messages/testing/test_keyframes.h"
#include "pangea/again_t.hpp"
#include "pangea/have_t.hpp"
#include "pangea/pose_t.hpp"
#include "pangea/status_t.hpp"

namespace pangea {
namespace {

TEST_F(LinkWorld, KeyframesArriveOnceInOrderByteIdentical) {
  link_bus.loss = 0.1;
  PublishKeyframes(50);
  Run(20);
  ExpectDelivered(50);
  EXPECT_EQ(acknowledged, 49);
}

// pangea-server shows these lines.
TEST_F(LinkWorld, WhoComesAndWhoIsRefusedIsToldOnce) {
  testing::internal::CaptureStderr();
  StartLog("pangea-test", "");
  PublishKeyframes(5);
  Run(2);
  KillUplink();
  std::filesystem::rename(KeyFile(1), folder / "server.key");
  MakeKeyFile(KeyFile(1), 1);
  StartUplink();  // with another key
  std::filesystem::rename(folder / "server.key", KeyFile(1));
  for (int second = 0; second < 10; ++second) {
    link_bus.Publish("LINK_UP_7", std::vector<uint8_t>(50));
    Run(1);
  }
  const std::string log = testing::internal::GetCapturedStderr();
  for (const std::string& line :
       {std::string("agent 1 has joined"),
        std::string("agent 1 sends keyframes: the first is in the journal"),
        fmt::format("agent 1 is refused: it has another key than the server's {}/keys/agent_1.key",
                    folder.string()),
        fmt::format("agent 7 is refused: the folder of keys, {}/keys, has no key for it",
                    folder.string())}) {
    const std::string whole = "\nagent_handler: " + line + "\n";
    const size_t at = log.find(whole);
    EXPECT_NE(at, std::string::npos) << line << "\n" << log;
    EXPECT_EQ(log.find(whole, at + 1), std::string::npos) << line;
  }
}

TEST_F(LinkWorld, HandlerKilledAndRestartedGoesOnFromItsJournal) {
  link_bus.loss = 0.05;
  PublishKeyframes(60);
  while (acknowledged < 20) {
    Run(0.05);
  }
  KillHandler();
  PublishKeyframes(10);
  Run(5);
  StartHandler();
  Run(20);
  EXPECT_EQ(acknowledged, 69);
  KillHandler();
  std::vector<std::vector<uint8_t>> journalled;
  const Journal journal(journal_path, [&](const std::string&, Bytes data, const JournalPlace&) {
    journalled.emplace_back(data.begin(), data.end());
    return true;
  });
  // Keyframes journalled but not published at the end are announced, and sent on request only.
  EXPECT_GE(delivered.size(), 60u);
  delivered = journalled;
  ExpectDelivered(70);
}

TEST_F(LinkWorld, ATornJournalIsHealedByRetransmission) {
  PublishKeyframes(5);
  Run(3);
  KillHandler();
  std::filesystem::resize_file(journal_path, std::filesystem::file_size(journal_path) - 1000);
  StartHandler();
  // The last keyframe had been acknowledged: only the odometry has it still.
  Run(10);
  EXPECT_EQ(acknowledged, 4);
  ASSERT_EQ(delivered.size(), 6u);
  EXPECT_EQ(delivered[5], EncodeTestKeyframe({kMap, 4}));
}

TEST_F(LinkWorld, UplinkKilledAndRestartedAsksTheOdometry) {
  link_bus.loss = 0.05;
  PublishKeyframes(60);
  Run(0.3);
  KillUplink();
  PublishKeyframes(20);
  Run(5);
  StartUplink();
  PublishKeyframes(1);
  Run(30);
  ExpectDelivered(81);
  EXPECT_EQ(acknowledged, 80);
}

// Nothing is published after the restart: the handler's list of maps shows where to look.
TEST_F(LinkWorld, UplinkRestartedAfterTheLastKeyframeFindsTheTail) {
  PublishKeyframes(20);
  while (acknowledged < 3) {
    Run(0.01);
  }
  KillUplink();
  Run(5);
  StartUplink();
  Run(10);
  ExpectDelivered(20);
}

TEST_F(LinkWorld, KeyframesWaitInTheUplinkWhileNoHandlerRuns) {
  KillHandler();
  PublishKeyframes(100);
  Run(10);
  EXPECT_EQ(acknowledged, -1);
  StartHandler();
  Run(10);
  ExpectDelivered(100);
}

TEST_F(LinkWorld, WhatIsNotOnDiskIsNotAcknowledged) {
  Run(2);
  {
    const FullDisk full(std::filesystem::file_size(journal_path));
    PublishKeyframes(5);
    Run(5);
  }
  EXPECT_EQ(acknowledged, -1);
  EXPECT_TRUE(delivered.empty());
  Run(10);
  EXPECT_EQ(acknowledged, 4);
  ExpectDelivered(5);
}

TEST_F(LinkWorld, KeyframesThatNobodyHasAreGivenUpAndNamedInHave) {
  std::vector<seq_gap_t> gaps;
  server_bus.Subscribe("HAVE", [&](const std::string&, Bytes data) {
    have_t have{};
    ASSERT_TRUE(DecodeMessage(data, &have));
    gaps = have.gaps;
  });
  published = oldest_kept = 5;
  PublishKeyframes(3);
  Run(20);
  EXPECT_EQ(acknowledged, 7);
  EXPECT_EQ(delivered.size(), 3u);
  ASSERT_EQ(gaps.size(), 1u);
  EXPECT_EQ(gaps[0].from_seq, 0);
  EXPECT_EQ(gaps[0].to_seq, 4);
}

TEST_F(LinkWorld, EveryGapOfAThinnedJournalIsNamedInHave) {
  KillHandler();
  // One of the maps has more than a message takes.
  const std::vector<int> num_gaps{600, 600, 1100, 50};
  {
    LogFileWriter journal(journal_path);
    for (int map = 0; map < std::ssize(num_gaps); ++map) {
      for (int32_t seq = 0; seq <= 2 * num_gaps[static_cast<size_t>(map)]; seq += 2) {
        journal.Write(0, "KEYFRAME_1", EncodeTestKeyframe({{1, 1000 + map}, seq}));
      }
    }
  }
  std::set<std::pair<int64_t, int32_t>> gaps;
  server_bus.Subscribe("HAVE", [&](const std::string&, Bytes data) {
    have_t have{};
    ASSERT_TRUE(DecodeMessage(data, &have));
    EXPECT_LE(have.num_gaps, 1000);
    for (const seq_gap_t& gap : have.gaps) {
      EXPECT_EQ(gap.from_seq, gap.to_seq);
      gaps.emplace(gap.map.opened_utime, gap.from_seq);
    }
  });
  StartHandler();
  Run(3);
  EXPECT_EQ(gaps.size(), 2350U);
}

TEST_F(LinkWorld, CorrectionsReachTheAgentAndPosesTheServer) {
  link_bus.loss = 0.2;
  std::vector<int64_t> revisions;
  agent_bus.Subscribe("CORRECTION_1", [&](const std::string&, Bytes data) {
    correction_t message{};
    ASSERT_TRUE(DecodeMessage(data, &message));
    revisions.push_back(message.revision);
  });
  int poses = 0;
  server_bus.Subscribe("POSE_1", [&](const std::string&, Bytes) { ++poses; });
  PublishKeyframes(1);
  Run(3);
  Correction correction;
  correction.map = correction.group = kMap;
  for (const int revision : {1, 2, 9, 4}) {
    correction.revision = revision;
    PublishMessage(server_bus, "CORRECTION_1", ToMessage(correction));
  }
  Run(5);
  EXPECT_THAT(revisions, testing::Each(9));
  EXPECT_FALSE(revisions.empty());
  pose_t pose{};
  pose.state = pose_t::STATE_TRACKING;
  pose.map = ToMessage(kMap);
  pose.T_odom_body = pose.T_map_body = ToMessage(Rigid3());
  pose.group_revision = 9;
  for (int i = 0; i < 100; ++i) {
    PublishMessage(agent_bus, "POSE_1", pose);
    Run(0.05);
  }
  EXPECT_GE(poses, 30);
  EXPECT_LE(poses, 51);
}

// The handler may hear of a map before the map's agent says hello: after a restart, it does.
TEST_F(LinkWorld, ACorrectionWaitsForItsAgentsHello) {
  PublishKeyframes(1);
  Run(3);
  KillHandler();
  KillUplink();
  StartHandler();
  Correction correction;
  correction.map = correction.group = kMap;
  for (const int revision : {3, 7, 5}) {
    correction.revision = revision;
    PublishMessage(server_bus, "CORRECTION_1", ToMessage(correction));
  }
  Run(1);
  std::vector<int64_t> revisions;
  agent_bus.Subscribe("CORRECTION_1", [&](const std::string&, Bytes data) {
    correction_t message{};
    ASSERT_TRUE(DecodeMessage(data, &message));
    revisions.push_back(message.revision);
  });
  StartUplink();
  Run(5);
  EXPECT_THAT(revisions, testing::Each(7));
  EXPECT_FALSE(revisions.empty());
}

TEST_F(LinkWorld, JournalledKeyframesAreRetransmitted) {
  PublishKeyframes(10);
  Run(3);
  std::vector<std::vector<uint8_t>> again;
  server_bus.Subscribe("AGAIN_fusion", [&](const std::string&, Bytes data) {
    again_t message{};
    ASSERT_TRUE(DecodeMessage(data, &message));
    EXPECT_EQ(message.channel, "KEYFRAME_1");
    again.push_back(message.data);
  });
  KillHandler();
  StartHandler();
  int32_t announced = -1;
  server_bus.Subscribe("HAVE", [&](const std::string&, Bytes data) {
    have_t have{};
    ASSERT_TRUE(DecodeMessage(data, &have));
    announced = have.num_maps == 1 ? have.highest_seq[0] : -2;
  });
  resend_request_t request{};
  request.requester = "fusion";
  request.channel = "KEYFRAME_1";
  request.map = ToMessage(kMap);
  request.to_seq = 1000;
  PublishMessage(server_bus, "RESEND_REQUEST", request);
  Run(3);
  EXPECT_EQ(announced, 9);
  EXPECT_EQ(again, delivered);
}

TEST_F(LinkWorld, MatchesAndResultsAreJournalledOnceAndMissingOnesRequested) {
  PublishKeyframes(4);
  Run(3);
  std::vector<std::string> asked;
  server_bus.Subscribe("RESEND_REQUEST", [&](const std::string&, Bytes data) {
    resend_request_t request{};
    ASSERT_TRUE(DecodeMessage(data, &request));
    if (request.requester == "agent_handler") {
      asked.push_back(request.channel + " " + std::to_string(request.from_seq) + " " +
                      std::to_string(request.to_seq));
    }
  });
  std::vector<verdict_request_t> results_requested;
  server_bus.Subscribe("VERDICT_REQUEST", [&](const std::string&, Bytes data) {
    ASSERT_TRUE(DecodeMessage(data, &results_requested.emplace_back()));
  });
  PlaceMatch match;
  for (const int seq : {0, 3, 3, 7}) {
    match.query = {kMap, seq};
    if (seq == 3) {
      match.candidates = {{{kMap, 0}, PlaceKind::kIntra, 1.0f, {}}};
    }
    PublishMessage(server_bus, "PLACE_MATCH", ToMessage(match));
  }
  Run(8);
  EXPECT_THAT(asked, testing::Contains("PLACE_MATCH 1 2"));
  ASSERT_FALSE(results_requested.empty());
  EXPECT_THAT(results_requested[0].seq, testing::ElementsAre(3));
  for (const int seq : {1, 2}) {
    match.query = {kMap, seq};
    match.candidates.clear();
    again_t again{};
    again.channel = "PLACE_MATCH";
    again.data = EncodeMessage(ToMessage(match));
    again.num_bytes = static_cast<int32_t>(again.data.size());
    PublishMessage(server_bus, "AGAIN_agent_handler", again);
  }
  Constraint result;
  result.from = {kMap, 0};
  result.to = {kMap, 3};
  result.kind = PlaceKind::kIntra;
  PublishMessage(server_bus, "CONSTRAINT", ToMessage(result));
  PublishMessage(server_bus, "CONSTRAINT", ToMessage(result));
  Run(10);
  asked.clear();
  results_requested.clear();
  Run(100);
  EXPECT_THAT(asked, testing::IsEmpty());
  EXPECT_TRUE(results_requested.empty());
  KillHandler();
  std::map<std::string, int> channels;
  const Journal journal(journal_path, [&](const std::string& channel, Bytes, const JournalPlace&) {
    ++channels[channel];
    return true;
  });
  EXPECT_THAT(channels,
              testing::ElementsAre(testing::Pair("CONSTRAINT", 1), testing::Pair("KEYFRAME_1", 4),
                                   testing::Pair("PLACE_MATCH", 4)));
}

// Each start that brings other options is one event; who repeats them, and who starts again with
// the same, is none.
TEST_F(LinkWorld, TheOptionsInForceAreJournalled) {
  const auto say = [this](const std::string& process, int64_t started, const std::string& yaml) {
    options_t message{};
    message.process = process;
    message.utime = started;
    message.yaml = yaml;
    PublishMessage(server_bus, "OPTIONS_" + process, message);
    Run(0.2);
  };
  for (int i = 0; i < 3; ++i) {
    say("fusion", kWall, "min_inliers: 20\n");
    say("posegraph", kWall, "scope: all\n");
  }
  KillHandler();
  StartHandler();
  say("fusion", kWall, "min_inliers: 20\n");
  say("fusion", kWall + 1, "min_inliers: 20\n");
  KillHandler();
  StartHandler();
  say("fusion", kWall - 1, "min_inliers: 22\n");  // the host's clock went back
  say("posegraph", kWall + 1, "scope: paper\n");
  say("posegraph", kWall, "scope: all\n");  // of one that has ended
  say("not a name", kWall, "");
  Run(1);
  KillHandler();
  std::vector<std::string> journalled;
  const Journal journal(journal_path,
                        [&](const std::string& channel, Bytes data, const JournalPlace&) {
                          options_t message{};
                          EXPECT_TRUE(DecodeMessage(data, &message)) << channel;
                          journalled.push_back(channel + " " + message.yaml);
                          return true;
                        });
  EXPECT_THAT(
      journalled,
      testing::ElementsAre("OPTIONS_fusion min_inliers: 20\n", "OPTIONS_posegraph scope: all\n",
                           "OPTIONS_fusion min_inliers: 22\n", "OPTIONS_posegraph scope: paper\n"));
}

// A budget costs corners, never a keyframe: the chain of poses has no gap.
TEST_F(LinkWorld, UnderABudgetKeyframesAreThinnedAndAllArrive) {
  KillUplink();
  options.budget_kb_per_s = 20;
  StartUplink();
  status_t status{};
  agent_bus.Subscribe("STATUS_uplink_1", [&](const std::string&, Bytes data) {
    ASSERT_TRUE(DecodeMessage(data, &status));
  });
  for (int i = 0; i < 80; ++i) {
    PublishKeyframes(1);
    Run(0.5);
  }
  Run(10);
  ASSERT_EQ(delivered.size(), 80u);
  size_t bytes = 0, with_corners = 0;
  for (int seq = 0; seq < 80; ++seq) {
    KeyframeMessage message{};
    ASSERT_TRUE(DecodeMessage(delivered[static_cast<size_t>(seq)], &message));
    const auto keyframe = Parse(message);
    ASSERT_TRUE(keyframe.value) << keyframe.refused;
    EXPECT_EQ(keyframe.value->id.seq, seq);
    EXPECT_EQ(keyframe.value->edge.has_value(), seq > 0);
    bytes += delivered[static_cast<size_t>(seq)].size();
    with_corners += keyframe.value->corners.empty() ? 0 : 1;
  }
  EXPECT_LT(static_cast<double>(bytes), 20e3 * 40 * 1.2) << "the first ones were full";
  EXPECT_GE(with_corners, 20u);
  const auto counter = [&](const char* name) { return CounterOf(status, name).value_or(-1); };
  EXPECT_EQ(counter("budget_bytes_per_s"), 20'000);
  EXPECT_GE(counter("rung"), 1);
  EXPECT_GT(counter("keyframes_thinned"), 20);
  EXPECT_THAT(status.summary, testing::HasSubstr(" of 20.0 kB/s, rung "));
}

}  // namespace
}  // namespace pangea
