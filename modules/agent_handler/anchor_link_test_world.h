#pragma once

// For tests: anchors between the apps of agent 1 and the server's bus, over the link of
// link_test_world.h.

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "agent_handler/link_test_world.h"
#include "messages/channels.h"
#include "messages/encoding.h"
#include "messages/testing/test_anchors.h"
#include "pangea/again_t.hpp"
#include "pangea/resend_request_t.hpp"
#include "pangea/status_t.hpp"

namespace pangea {

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
  void PublishPose(int64_t utime, const Eigen::Vector3d& t_odom_body = {0, 0, 0},
                   const MapId& map = kMap) {
    pose_t pose{};
    pose.utime = utime;
    pose.state = pose_t::STATE_TRACKING;
    pose.map = ToMessage(map);
    pose.T_odom_body = pose.T_map_body =
        ToMessage(Rigid3(Eigen::Quaterniond::Identity(), t_odom_body));
    PublishMessage(agent_bus, "POSE_1", pose);
  }
  void MakeLinkBad() {
    link_bus.loss = 0.3;
    link_bus.doubled = 0.2;
    link_bus.held = 0.2;
  }
  // An edit may come more than once; then it must be identical.
  void OnJournalled(Bytes data) {
    anchor_edit_t message{};
    ASSERT_TRUE(DecodeMessage(data, &message));
    const AnchorEdit edit = Parse(message).value.value();
    journalled.emplace(edit.seq, edit);
    const std::vector<uint8_t> bytes(data.begin(), data.end());
    EXPECT_EQ(journalled_bytes.emplace(edit.seq, bytes).first->second, bytes);
  }
  // Asks for missing edits, as a follower does: edits that were on the disk but not yet published
  // when the server was killed.
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
  // Expects `count` edits, with seqs without a gap and each (anchor, revision, editor) only once.
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

  // Of each anchor, the journalled edit with the highest revision.
  std::map<AnchorId, AnchorEdit> NewestJournalled() const {
    std::map<AnchorId, AnchorEdit> newest;
    for (const auto& [seq, edit] : journalled) {
      if (newest[edit.anchor].revision <= edit.revision) {
        newest[edit.anchor] = edit;
      }
    }
    return newest;
  }
  // Publishes poses, and a tap on an image between two of them, at which x is 0.25 m.
  void RequestTap() {
    for (int i = 0; i < 5; ++i) {
      PublishPose(1'000'000 + 50'000 * i, {0.1 * i, 0, 0});
    }
    Run(0.1);
    AnchorEdit edit = TestEdit({1, 5}, 1, 1);
    edit.map = kMap;
    edit.placement = AnchorEdit::Placement::kPixel;
    edit.utime = 1'125'000;
    Request(edit);
  }

  std::map<int64_t, AnchorEdit> journalled;
  std::map<int64_t, std::vector<uint8_t>> journalled_bytes;  // by seq
  std::map<AnchorId, AnchorState> heard;
  int num_heard = 0;
  std::optional<ShownAnchors> shown;
  std::map<std::string, int64_t> handler_counters, uplink_counters;
  std::set<std::string> handler_refused, uplink_refused;
};

}  // namespace pangea
