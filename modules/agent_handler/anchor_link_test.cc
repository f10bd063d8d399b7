// Anchors over the link: who may edit what, what is told to whom, and at what rate.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "agent_handler/anchor_link_test_world.h"
#include "messages/encoding.h"

namespace pangea {
namespace {

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

TEST_F(AnchorLink, ATapCarriesThePoseOfItsImage) {
  Run(2);
  RequestTap();
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

// Else the server would wait for ever: no keyframe of that map comes after the tap.
TEST_F(AnchorLink, ATapJustBeforeItsMapEndsCarriesThePoseOfItsImage) {
  Run(2);
  RequestTap();
  Run(0.1);
  PublishPose(1'300'000, {9, 9, 9}, {kMap.agent_id, kMap.opened_utime + 1});
  Run(12);
  ASSERT_EQ(journalled.size(), 1u);
  ASSERT_TRUE(journalled.begin()->second.T_odom_body);
  EXPECT_NEAR(journalled.begin()->second.T_odom_body->t.x(), 0.25, 1e-9);
}

TEST_F(AnchorLink, AnOvertakenStateDoesNotReplaceANewerOne) {
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

TEST_F(AnchorLink, EditsThatTheKeyForbidsAreRefusedAndNotSentForEver) {
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

AnchorEdit Nameless(AnchorEdit edit) {
  edit.name.clear();
  return edit;
}

TEST_F(AnchorLink, AnAnchorWithoutANameIsRefused) {
  PublishMessage(server_bus, channels::AnchorRequest(0),
                 ToMessage(Nameless(TestEdit({2, 5}, 1, 0))));
  Request(Nameless(TestEdit({1, 5}, 1, 1)));
  Run(2);
  ExpectOnceEach(0);
  EXPECT_THAT(handler_refused, testing::Contains("anchor edit: no name"));
  EXPECT_THAT(uplink_refused, testing::Contains("anchor edit: no name"));
  AnchorEdit deletion = Nameless(TestEdit({1, 5}, 2, 1));
  deletion.deleted = true;
  Request(deletion);
  Run(2);
  ExpectOnceEach(1);
}

// Some terminals obey U+009B.
TEST_F(AnchorLink, ANameWithControlCharactersIsRefused) {
  AnchorEdit edit = TestEdit({1, 5}, 1, 1);
  edit.name = "a\xc2\x9b[2J";
  Request(edit);
  edit.anchor = {2, 5};
  edit.agent_id = 0;
  PublishMessage(server_bus, channels::AnchorRequest(0), ToMessage(edit));
  Run(2);
  ExpectOnceEach(0);
  const char* const refusal = "anchor edit: control characters in the name";
  EXPECT_THAT(handler_refused, testing::Contains(refusal));
  EXPECT_THAT(uplink_refused, testing::Contains(refusal));
}

// As by the uplink of an earlier version.
TEST_F(AnchorLink, AnAnchorWithoutANameIsRefusedToTheAgentToo) {
  KillUplink();
  UplinkSession session(1, ReadKeyFileOf(KeyFile(1), 1));
  std::vector<AnchorEditAnswer> answers;
  link_bus.Subscribe("LINK_DOWN_1", [&](const std::string&, Bytes data) {
    const auto opened = session.Open(data);
    if (opened.packet && opened.packet->kind == LinkKind::kAnchorEditAnswers) {
      answers = ParseAnchorEditAnswers(opened.packet->body).value.value();
    }
  });
  int64_t number = 0;
  const auto send = [&](LinkKind kind, const std::vector<uint8_t>& body) {
    link_bus.Publish("LINK_UP_1", session.Seal({kind, ++number, body}));
    Run(1);
  };
  for (int i = 0; i < 3; ++i) {
    send(LinkKind::kHello, Encode(LinkHello{"test", {}}));
  }
  send(LinkKind::kAnchorEdit, EncodeAnchorEdit(Nameless(TestEdit({1, 5}, 1, 1))));
  ExpectOnceEach(0);
  ASSERT_EQ(answers.size(), 1u);
  EXPECT_EQ(answers[0].anchor, (AnchorId{1, 5}));
  EXPECT_FALSE(answers[0].journalled);
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

TEST_F(AnchorLink, AnchorsBeyondAnAgentsLimitAreLeftOutAndCounted) {
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
TEST_F(AnchorLink, StatesThatAreNeverConfirmedAreRepeatedAtABoundedRate) {
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
TEST_F(AnchorLink, ArbitraryAnchorMessagesCrashNoProcess) {
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
