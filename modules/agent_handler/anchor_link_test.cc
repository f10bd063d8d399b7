// Anchors over a link that loses, doubles and reorders, while either end is killed.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <random>
#include <set>

#include "agent_handler/link_test_world.h"
#include "messages/channels.h"
#include "messages/testing/test_anchors.h"
#include "pangea/again_t.hpp"
#include "pangea/resend_request_t.hpp"
#include "pangea/status_t.hpp"

namespace pangea {
namespace {

class AnchorLink : public LinkWorld {
 protected:
  void SetUp() override {
    LinkWorld::SetUp();
    server_bus.Subscribe("ANCHOR_EDIT",
                         [this](const std::string&, Bytes data) { OnJournalled(data); });
    server_bus.Subscribe("AGAIN_anchors", [this](const std::string&, Bytes data) {
      again_t again{};
      ASSERT_TRUE(DecodeMessage(data, &again));
      OnJournalled(again.data);
    });
    agent_bus.Subscribe("ANCHOR_1", [this](const std::string&, Bytes data) {
      anchor_t message{};
      ASSERT_TRUE(DecodeMessage(data, &message));
      const AnchorState state = Parse(message).value.value();
      heard[state.anchor] = state;
      ++num_heard;
    });
    agent_bus.Subscribe("SHOWN_ANCHORS_1", [this](const std::string&, Bytes data) {
      shown_anchors_t message{};
      ASSERT_TRUE(DecodeMessage(data, &message));
      shown = Parse(message).value.value();
    });
    Listen(server_bus, "STATUS_agent_handler", &handler_counters, &handler_refused);
    Listen(agent_bus, "STATUS_uplink_1", &uplink_counters, &uplink_refused);
  }
  static void Listen(Bus& bus, const char* channel, std::map<std::string, int64_t>* counters,
                     std::set<std::string>* refused) {
    bus.Subscribe(channel, [counters, refused](const std::string&, Bytes data) {
      status_t status{};
      ASSERT_TRUE(DecodeMessage(data, &status));
      for (const counter_t& counter : status.counters) {
        (*counters)[counter.name] = counter.count;
      }
      for (const counter_t& reason : status.refused) {
        refused->insert(reason.name);
      }
    });
  }
  void Request(const AnchorEdit& edit) {
    PublishMessage(agent_bus, channels::AnchorRequest(1), ToMessage(edit));
  }
  void PublishAnchor(const AnchorState& state) {
    PublishMessage(server_bus, channels::Anchor(1), ToMessage(state));
  }
  void PublishPose(int64_t utime, const Eigen::Vector3d& t_odom_body = {0, 0, 0}) {
    pose_t pose{};
    pose.utime = utime;
    pose.state = pose_t::STATE_TRACKING;
    pose.map = ToMessage(kMap);
    pose.T_odom_body = pose.T_map_body =
        ToMessage(Rigid3(Eigen::Quaterniond::Identity(), t_odom_body));
    PublishMessage(agent_bus, "POSE_1", pose);
  }
  void MakeLinkBad() {
    link_bus.loss = 0.3;
    link_bus.doubled = 0.2;
    link_bus.held = 0.2;
  }
  // One may come again, and is then the same.
  void OnJournalled(Bytes data) {
    anchor_edit_t message{};
    ASSERT_TRUE(DecodeMessage(data, &message));
    const AnchorEdit edit = Parse(message).value.value();
    journalled.emplace(edit.seq, edit);
    const std::vector<uint8_t> bytes(data.begin(), data.end());
    EXPECT_EQ(journalled_bytes.emplace(edit.seq, bytes).first->second, bytes);
  }
  // As a follower does: what was on the disk when the server was killed has not been published.
  void FillGaps() {
    int32_t seq = 0;
    for (; journalled.contains(seq); ++seq) {
    }
    if (!journalled.empty() && seq < journalled.rbegin()->first) {
      resend_request_t request{};
      request.requester = "anchors";
      request.channel = channels::kAnchorEdit;
      request.map = ToMessage(kMap);
      request.from_seq = seq;
      request.to_seq = static_cast<int32_t>(journalled.rbegin()->first);
      PublishMessage(server_bus, std::string(channels::kResendRequest), request);
      Run(1);
    }
  }
  // Seqs without a gap; (anchor, revision, editor) once each.
  void ExpectOnceEach(size_t count) {
    FillGaps();
    std::set<std::tuple<AnchorId, int64_t, int32_t>> keys;
    int64_t next = 0;
    for (const auto& [seq, edit] : journalled) {
      EXPECT_EQ(seq, next++);
      EXPECT_TRUE(keys.emplace(edit.anchor, edit.revision, edit.agent_id).second);
    }
    EXPECT_EQ(journalled.size(), count);
  }

  std::map<int64_t, AnchorEdit> journalled;
  std::map<int64_t, std::vector<uint8_t>> journalled_bytes;  // by seq
  std::map<AnchorId, AnchorState> heard;
  int num_heard = 0;
  std::optional<ShownAnchors> shown;
  std::map<std::string, int64_t> handler_counters, uplink_counters;
  std::set<std::string> handler_refused, uplink_refused;
};

TEST_F(AnchorLink, AnEditIsJournalledAndTheStateComesBack) {
  Request(TestEdit({1, 5}, 1, 0));
  Run(2);
  ExpectOnceEach(1);
  EXPECT_EQ(journalled[0].agent_id, 1);
  EXPECT_EQ(journalled[0].right, AnchorRight::kEditOwn);
  EXPECT_EQ(journalled[0].T_ref_anchor.t, Eigen::Vector3d(1, 2, 3));
  PublishPose(77);
  PublishAnchor(TestAnchor({1, 5}, 1, kMap));
  Run(1);
  EXPECT_EQ(num_heard, 1);
  EXPECT_EQ(heard.at({1, 5}).revision, 1);
  ASSERT_TRUE(shown);
  EXPECT_EQ(shown->utime, 77);
  ASSERT_EQ(shown->anchors.size(), 1u);
  EXPECT_EQ(shown->anchors[0].T_odom_anchor.t, Eigen::Vector3d(1, 2, 3));
  Run(10);
  EXPECT_EQ(num_heard, 2) << "again every 10 s";
  EXPECT_EQ(uplink_counters.at("anchor_edits_waiting"), 0);
  EXPECT_EQ(handler_counters.at("anchors_unconfirmed"), 0);
  EXPECT_EQ(handler_counters.at("anchors_sent"), 1);
}

// Apps repeat what they have not seen come back: without a spool a killed uplink forgets it.
TEST_F(AnchorLink, ATapCarriesThePoseOfItsImage) {
  Run(2);
  for (int i = 0; i < 5; ++i) {
    PublishPose(1'000'000 + 50'000 * i, {0.1 * i, 0, 0});
  }
  Run(0.1);
  AnchorEdit edit = TestEdit({1, 5}, 1, 1);
  edit.map = kMap;
  edit.placement = AnchorEdit::Placement::kPixel;
  edit.utime = 1'125'000;
  Request(edit);
  Run(1);
  EXPECT_TRUE(journalled.empty()) << "a keyframe after it would say better where it was";
  AnchorEdit renamed = TestEdit({1, 5}, 2, 1);
  renamed.placement = AnchorEdit::Placement::kSame;
  Request(renamed);
  Run(1);
  ASSERT_EQ(journalled.size(), 1u);
  EXPECT_EQ(journalled.begin()->second.revision, 2);
  ASSERT_TRUE(journalled.begin()->second.T_odom_body);
  EXPECT_NEAR(journalled.begin()->second.T_odom_body->t.x(), 0.25, 1e-9);
}

TEST_F(AnchorLink, EditsAreJournalledOnceEachThoughBothEndsAreKilled) {
  MakeLinkBad();
  std::mt19937_64 rng(5);
  constexpr int kAnchors = 30;
  std::map<AnchorId, int64_t> wanted;
  for (int round = 0; round < 12; ++round) {
    for (int i = 0; i < 10; ++i) {
      const AnchorId id{1, static_cast<int64_t>(rng() % kAnchors)};
      ++wanted[id];
    }
    for (const auto& [id, revision] : wanted) {
      Request(TestEdit(id, revision, 1));
    }
    Run(0.02 * static_cast<double>(rng() % 100));
    if (round % 3 == 0) {
      KillHandler();
      Run(0.1);
      StartHandler();
    } else if (round % 3 == 1) {
      KillUplink();
      StartUplink();
    }
  }
  for (const auto& [id, revision] : wanted) {
    Request(TestEdit(id, revision, 1));
  }
  Run(60);
  FillGaps();
  ExpectOnceEach(journalled.size());
  std::map<AnchorId, int64_t> newest;
  for (const auto& [seq, edit] : journalled) {
    newest[edit.anchor] = std::max(newest[edit.anchor], edit.revision);
  }
  EXPECT_EQ(newest, wanted);
  EXPECT_EQ(uplink_counters.at("anchor_edits_waiting"), 0);
}

// Made, moved, renamed, deleted, each said once; a file that the killed process was writing lies
// beside the others.
TEST_F(AnchorLink, AKilledUplinkWithASpoolLosesNoEdit) {
  KillUplink();
  spools_edits = true;
  StartUplink();
  MakeLinkBad();
  std::mt19937_64 rng(11);
  std::map<AnchorId, AnchorEdit> wanted;
  for (int i = 0; i < 120; ++i) {
    const AnchorId id{1, static_cast<int64_t>(rng() % 40)};
    AnchorEdit edit = TestEdit(id, i + 1, 1);
    if (wanted[id].deleted) {
      continue;
    }
    edit.deleted = i > 60 && rng() % 4 == 0;
    if (rng() % 3 == 0 && wanted[id].revision > 1) {
      edit.placement = AnchorEdit::Placement::kSame;
      edit.name = "pot";
    }
    wanted[id] = edit;
    Request(edit);
    Run(0.01 * static_cast<double>(rng() % 8));
    if (i % 4 == 0) {
      KillUplink();
      std::ofstream(folder / "anchor_1_5.lcm.new") << "torn";
      StartUplink();
    }
    if (i % 25 == 0) {
      KillHandler();
      Run(0.1);
      StartHandler();
    }
  }
  Run(60);
  ExpectOnceEach(journalled.size());
  std::map<AnchorId, AnchorEdit> newest;
  for (const auto& [seq, edit] : journalled) {
    if (newest[edit.anchor].revision <= edit.revision) {
      newest[edit.anchor] = edit;
    }
  }
  ASSERT_EQ(newest.size(), wanted.size());
  for (const auto& [id, edit] : wanted) {
    EXPECT_EQ(newest[id].revision, edit.revision);
    EXPECT_EQ(newest[id].deleted, edit.deleted);
    EXPECT_EQ(newest[id].name, edit.name);
  }
  EXPECT_EQ(uplink_counters.at("anchor_edits_waiting"), 0);
  const size_t before = journalled.size();
  KillUplink();
  uplink_counters.clear();
  StartUplink();
  Run(5);
  EXPECT_EQ(journalled.size(), before) << "what was answered is not sent again";
  EXPECT_FALSE(uplink_counters.contains("anchor_edits"));
}

// Before a keyframe has said where that was: then as it was known live.
TEST_F(AnchorLink, AKilledUplinkWithASpoolKeepsATap) {
  KillUplink();
  spools_edits = true;
  StartUplink();
  for (int i = 0; i < 5; ++i) {
    PublishPose(1'000'000 + 50'000 * i, {0.1 * i, 0, 0});
  }
  Run(0.1);
  AnchorEdit edit = TestEdit({1, 5}, 1, 1);
  edit.map = kMap;
  edit.placement = AnchorEdit::Placement::kPixel;
  edit.utime = 1'125'000;
  Request(edit);
  Run(0.1);
  KillUplink();
  EXPECT_TRUE(journalled.empty());
  StartUplink();
  Run(2);
  ASSERT_EQ(journalled.size(), 1u);
  ASSERT_TRUE(journalled[0].T_odom_body);
  EXPECT_NEAR(journalled[0].T_odom_body->t.x(), 0.25, 1e-9);
}

// None that the uplink took is lost when only the server dies, however often.
TEST_F(AnchorLink, AKilledServerLosesNoEdit) {
  MakeLinkBad();
  for (int i = 0; i < 50; ++i) {
    Request(TestEdit({1, i}, 1, 1));
    Run(0.05);
    if (i % 5 == 4) {
      KillHandler();
      Run(0.05);
      StartHandler();
    }
  }
  Run(40);
  ExpectOnceEach(50);
  const size_t before = journalled.size();
  for (int i = 0; i < 50; ++i) {
    Request(TestEdit({1, i}, 1, 1));  // once more, all of it
  }
  KillHandler();
  StartHandler();
  Run(40);
  EXPECT_EQ(journalled.size(), before);
  EXPECT_EQ(uplink_counters.at("anchor_edits_waiting"), 0);
}

TEST_F(AnchorLink, StatesArriveAndTheNewestWins) {
  MakeLinkBad();
  std::mt19937_64 rng(6);
  std::map<AnchorId, AnchorState> newest;
  for (int i = 0; i < 190; ++i) {
    const AnchorId id{2, static_cast<int64_t>(rng() % 20)};
    AnchorState& state = newest[id];
    state = TestAnchor(id, state.revision + 1, kMap, {0.1 * i, 1, 2});
    state.gone = i > 150 && rng() % 2 == 0;
    PublishAnchor(state);
    Run(0.05);
    if (i % 40 == 20) {
      KillUplink();
      StartUplink();
    }
    if (i % 40 == 39) {
      KillHandler();
      StartHandler();
      for (const auto& [unused, all] : newest) {
        PublishAnchor(all);  // as pangea-anchors does every ten seconds
      }
    }
  }
  Run(30);
  ASSERT_EQ(heard.size(), newest.size());
  for (const auto& [id, state] : newest) {
    EXPECT_EQ(EncodeMessage(ToMessage(heard.at(id))), EncodeMessage(ToMessage(state)));
  }
  EXPECT_EQ(handler_counters.at("anchors_unconfirmed"), 0);
}

TEST_F(AnchorLink, WhatWasOvertakenDoesNotWin) {
  link_bus.held = 0.3;
  Run(2);
  for (int64_t revision = 1; revision < 100; ++revision) {
    PublishAnchor(TestAnchor({2, 5}, revision, kMap));
    Run(0.01);
    PublishAnchor(TestAnchor({2, 5}, ++revision, kMap));
    Run(2);
    ASSERT_EQ(heard.at({2, 5}).revision, revision);
  }
}

TEST_F(AnchorLink, ARestartedUplinkHearsAllAgain) {
  for (int i = 0; i < 20; ++i) {
    PublishAnchor(TestAnchor({2, i}, 1, kMap));
  }
  Run(8);
  EXPECT_EQ(heard.size(), 20u);
  heard.clear();
  KillUplink();
  StartUplink();
  Run(8);
  EXPECT_EQ(heard.size(), 20u);
}

TEST_F(AnchorLink, WhatTheKeyDoesNotAllowIsRefusedAndNotSentForEver) {
  Request(TestEdit({2, 5}, 1, 1));  // another agent's anchor
  Request(TestEdit({1, 5}, 1, 1));
  Run(2);
  ExpectOnceEach(1);
  EXPECT_EQ(handler_counters.at("anchor_edits_refused"), 1);
  EXPECT_THAT(handler_refused,
              testing::Contains("agent 1's key does not allow its edit of an anchor"));
  EXPECT_EQ(uplink_counters.at("anchor_edits_refused"), 1);
  EXPECT_EQ(uplink_counters.at("anchor_edits_waiting"), 0);
  SetAnchorRight("write");
  Run(2);
  Request(TestEdit({2, 5}, 2, 1));
  Run(2);
  ExpectOnceEach(2);
  EXPECT_EQ(journalled[1].right, AnchorRight::kEditAll);
  SetAnchorRight("read");
  Run(2);
  Request(TestEdit({1, 5}, 2, 1));
  Run(2);
  ExpectOnceEach(2);
  EXPECT_EQ(handler_counters.at("anchor_edits_refused"), 2);
  EXPECT_EQ(handler_counters.at("agents"), 1) << "without another session";
}

TEST_F(AnchorLink, AnotherAgentsRequestsAreRefused) {
  Request(TestEdit({1, 5}, 1, 7));
  anchor_edit_t bad = ToMessage(TestEdit({1, 6}, 1, 1));
  bad.revision = 0;
  PublishMessage(agent_bus, channels::AnchorRequest(1), bad);
  Run(2);
  ExpectOnceEach(0);
  EXPECT_THAT(uplink_refused,
              testing::IsSupersetOf({"another agent's edit of an anchor",
                                     "anchor edit: invalid id, editor, revision or right"}));
}

TEST_F(AnchorLink, ToolsOnTheServersBusEditAll) {
  AnchorEdit edit = TestEdit({2, 5}, 1, 44);
  edit.right = AnchorRight::kRead;
  edit.seq = 9;
  PublishMessage(server_bus, channels::AnchorRequest(0), ToMessage(edit));
  PublishMessage(server_bus, channels::AnchorRequest(0), ToMessage(edit));
  Run(1);
  ExpectOnceEach(1);
  EXPECT_EQ(journalled[0].agent_id, 0);
  EXPECT_EQ(journalled[0].right, AnchorRight::kEditAll);
  // Nobody but an agent asks for an agent.
  PublishMessage(server_bus, channels::AnchorRequest(1), ToMessage(TestEdit({1, 5}, 1, 1)));
  Run(1);
  ExpectOnceEach(1);
}

TEST_F(AnchorLink, MoreThanAnAgentTakesAreLeftOutAndSaid) {
  for (int i = 0; i < 300; ++i) {
    PublishAnchor(TestAnchor({2, i}, 1, kMap));
  }
  Run(60);
  EXPECT_EQ(heard.size(), 256u);
  EXPECT_EQ(handler_counters.at("anchors_left_out"), 44);
  EXPECT_THAT(handler_refused,
              testing::Contains("agent 1 has 256 anchors: no more are sent to it"));
}

// An agent that never confirms, as one of an earlier version, costs no more than the rate; one that
// is away costs nothing.
TEST_F(AnchorLink, ADeafAgentCostsABoundedRate) {
  KillUplink();
  UplinkSession session(1, ReadKeyFileOf(KeyFile(1), 1));
  int64_t bytes = 0;
  link_bus.Subscribe("LINK_DOWN_1", [&](const std::string& channel, Bytes data) {
    const auto opened = session.Open(data);
    bytes += opened.packet && opened.packet->kind == LinkKind::kAnchor
                 ? BytesOnTheWire(channel, data)
                 : 0;
  });
  for (int i = 0; i < 200; ++i) {
    PublishAnchor(TestAnchor({2, i}, 1, kMap));
  }
  int64_t number = 0;
  const auto hellos = [&](int count) {
    for (int i = 0; i < count; ++i) {
      link_bus.Publish("LINK_UP_1",
                       session.Seal({LinkKind::kHello, ++number, Encode(LinkHello{"test", {}})}));
      Run(1);
    }
  };
  hellos(4);
  const int64_t begin = bytes;
  hellos(20);
  EXPECT_LE(bytes - begin, 20 * 4000 + 1400);
  EXPECT_GE(bytes - begin, 19 * 4000);
  Run(5);
  const int64_t away = bytes;
  Run(20);
  EXPECT_EQ(bytes, away);
}

// Noise and damaged messages on every channel of anchors, and in packets that open.
TEST_F(AnchorLink, NothingOfAnchorsCrashesAProcess) {
  const std::vector<std::vector<uint8_t>> payloads = {
      EncodeMessage(ToMessage(TestEdit({1, 5}, 1, 1))),
      EncodeMessage(ToMessage(TestAnchor({1, 5}, 1, kMap))),
      EncodeAnchor(3, EncodeMessage(ToMessage(TestAnchor({1, 5}, 1, kMap)))),
      EncodeAnchorsReceived({1, 2, 70'000}),
      EncodeAnchorEditAnswers({{{1, 5}, 1, true}, {{3, 4}, 5, false}})};
  KillUplink();
  UplinkSession session(1, ReadKeyFileOf(KeyFile(1), 1));
  link_bus.Subscribe("LINK_DOWN_1", [&](const std::string&, Bytes data) { session.Open(data); });
  int64_t number = 0;
  for (int i = 0; i < 3; ++i) {
    link_bus.Publish("LINK_UP_1",
                     session.Seal({LinkKind::kHello, ++number, Encode(LinkHello{"test", {}})}));
    Run(0.1);
  }
  std::mt19937_64 rng(8);
  for (int i = 0; i < 3000; ++i) {
    std::vector<uint8_t> data = payloads[rng() % payloads.size()];
    for (int flips = static_cast<int>(rng() % 4); flips > 0; --flips) {
      data[rng() % data.size()] ^= static_cast<uint8_t>(1 + rng() % 255);
    }
    data.resize(rng() % 5 == 0 ? rng() % data.size() : data.size());
    const LinkKind kinds[] = {LinkKind::kAnchorEdit, LinkKind::kAnchorsReceived, LinkKind::kAnchor,
                              LinkKind::kAnchorEditAnswers};
    link_bus.Publish("LINK_UP_1", session.Seal({kinds[rng() % 4], ++number, data}));
    for (const char* channel : {"ANCHOR_1", "ANCHOR_7", "ANCHOR_REQUEST_0"}) {
      server_bus.Publish(channel, data);
    }
    agent_bus.Publish("ANCHOR_REQUEST_1", data);
    if (i % 100 == 0) {
      Run(0.01);
    }
  }
  Run(1);
  EXPECT_GT(handler_refused.size(), 5u);
  StartUplink();
  PublishKeyframes(5);
  Request(TestEdit({1, 99}, 1, 1));
  Run(10);
  ExpectDelivered(5);
  const bool arrived = std::ranges::any_of(journalled, [](const auto& item) {
    return item.second.anchor == AnchorId{1, 99};
  });
  EXPECT_TRUE(arrived);
}

}  // namespace
}  // namespace pangea
