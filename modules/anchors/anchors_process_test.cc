#include "anchors/anchors_process.h"

#include <gtest/gtest.h>

#include <vector>

#include "core/testing/synthetic_world.h"
#include "messages/anchor_messages.h"
#include "messages/channels.h"
#include "messages/encoding.h"
#include "pangea/again_t.hpp"
#include "pangea/have_t.hpp"
#include "pangea/resend_request_t.hpp"
#include "pangea/status_t.hpp"

namespace pangea {
namespace {

constexpr int64_t kTick_us = 100'000;

class AnchorsProcessTest : public testing::Test {
 protected:
  AnchorsProcessTest() : process_(bus_, AnchorsOptions()) {
    SyntheticWorldOptions options;
    options.num_keyframes = 10;
    options.with_corners = false;
    world_ = MakeSyntheticWorld(options);
    bus_.Subscribe("ANCHOR_2", [this](const std::string&, Bytes data) {
      DecodeMessage(data, &for_agent_2_.emplace_back());
    });
    bus_.Subscribe("OTHERS_2", [this](const std::string&, Bytes data) {
      DecodeMessage(data, &others_of_2_.emplace_back());
    });
    bus_.Subscribe("ANCHOR", [this](const std::string&, Bytes data) {
      DecodeMessage(data, &for_watchers_.emplace_back());
    });
    bus_.Subscribe("RESEND_REQUEST", [this](const std::string&, Bytes data) {
      resend_request_t request{};
      DecodeMessage(data, &request);
      if (request.channel == channels::kAnchorEdit) {
        requests_.push_back(request);
      }
    });
    bus_.Subscribe("STATUS_anchors",
                   [this](const std::string&, Bytes data) { DecodeMessage(data, &status_); });
  }

  static anchor_edit_t Edit(int64_t seq, const SyntheticAgent& agent) {
    AnchorEdit edit;
    edit.anchor = {1, 100 + seq};
    edit.agent_id = 1;
    edit.right = AnchorRight::kEditOwn;
    edit.seq = seq;
    edit.placement = AnchorEdit::Placement::kKeyframe;
    edit.map = agent.map;
    edit.keyframe_seq = 5;
    edit.T_ref_anchor.t = {1, 0, 0};
    return ToMessage(edit);
  }
  // At a time after the last keyframe of the first agent's map.
  anchor_edit_t EditAfterTheMap() const {
    const Keyframe& last = world_.agents[0].keyframes.back();
    anchor_edit_t edit = Edit(0, world_.agents[0]);
    edit.placement = anchor_edit_t::PLACEMENT_BODY;
    edit.utime = last.utime + 300'000;
    edit.has_T_odom_body = 1;
    edit.T_odom_body = ToMessage(last.T_odom_body);
    return edit;
  }
  void SendMap() {
    MapState state;
    state.group = world_.agents[0].map;
    state.revision = ++revision_;
    for (const SyntheticAgent& agent : world_.agents) {
      state.maps.push_back(agent.map);
      for (const Keyframe& keyframe : agent.keyframes) {
        if (revision_ == 1) {
          PublishMessage(bus_, channels::Keyframe(agent.map.agent_id), ToMessage(keyframe));
        }
        state.keyframes.push_back({keyframe.id, keyframe.utime, world_.T_hall_body(keyframe.id)});
      }
    }
    for (const map_state_t& chunk : ToMessages(state)) {
      PublishMessage(bus_, "MAP_STATE", chunk);
    }
    bus_.Drain();
  }
  void SendPoses() {
    for (const SyntheticAgent& agent : world_.agents) {
      pose_t pose{};
      pose.state = pose_t::STATE_TRACKING;
      pose.map = ToMessage(agent.map);
      pose.T_odom_body = ToMessage(agent.keyframes.back().T_odom_body);
      PublishMessage(bus_, channels::Pose(agent.map.agent_id), pose);
    }
    bus_.Drain();
  }
  void Send(const anchor_edit_t& edit) {
    PublishMessage(bus_, "ANCHOR_EDIT", edit);
    bus_.Drain();
  }
  void Tick(int times) {
    for (int i = 0; i < times; ++i) {
      process_.Tick(now_utime_ += kTick_us);
      bus_.Drain();
    }
  }

  LocalBus bus_;
  AnchorsProcess process_;
  SyntheticWorld world_;
  std::vector<anchor_t> for_agent_2_, for_watchers_;
  std::vector<others_t> others_of_2_;
  std::vector<resend_request_t> requests_;
  status_t status_{};
  int64_t now_utime_ = 1'700'000'000'000'000;
  int64_t revision_ = 0;
};

TEST_F(AnchorsProcessTest, AnAnchorReachesTheOtherAgentAndWatchers) {
  SendMap();
  Send(Edit(0, world_.agents[0]));
  Tick(2);
  ASSERT_EQ(for_agent_2_.size(), 1u);
  EXPECT_EQ(for_agent_2_[0].state, anchor_t::STATE_PLACED);
  EXPECT_EQ(for_agent_2_[0].map.agent_id, 2);
  EXPECT_TRUE(Parse(for_agent_2_[0]).value) << Parse(for_agent_2_[0]).refused;
  ASSERT_EQ(for_watchers_.size(), 1u);
  EXPECT_EQ(for_watchers_[0].map.agent_id, 1);
}

// Its clock was set back: the id of its newest map is not the highest.
TEST_F(AnchorsProcessTest, AnAgentHearsOfAnchorsInTheMapThatItsPosesAreIn) {
  SyntheticAgent restarted = world_.agents[1];
  --restarted.map.opened_utime;
  for (Keyframe& keyframe : restarted.keyframes) {
    keyframe.id.map = restarted.map;
    PublishMessage(bus_, channels::Keyframe(2), ToMessage(keyframe));
  }
  SendMap();
  Send(Edit(0, restarted));
  Tick(3);
  EXPECT_TRUE(for_agent_2_.empty());
  world_.agents[1] = restarted;
  SendPoses();
  Tick(3);
  ASSERT_FALSE(for_agent_2_.empty());
  EXPECT_EQ(for_agent_2_.back().map.opened_utime, restarted.map.opened_utime);
}

TEST_F(AnchorsProcessTest, AnAgentHearsOfTheOthersFiveTimesASecond) {
  SendMap();
  for (int i = 0; i < 20; ++i) {
    SendPoses();
    Tick(1);
  }
  EXPECT_GE(others_of_2_.size(), 9u);
  EXPECT_LE(others_of_2_.size(), 11u);
  ASSERT_EQ(others_of_2_.back().num_others, 1);
  EXPECT_EQ(others_of_2_.back().others[0].agent_id, 1);
  EXPECT_EQ(others_of_2_.back().map.agent_id, 2);
  const size_t told = others_of_2_.size();
  Tick(40);
  EXPECT_LE(others_of_2_.size(), told + 11);  // until the poses are two seconds old
}

TEST_F(AnchorsProcessTest, WhatDoesNotChangeIsSaidAgainEveryTenSeconds) {
  SendMap();
  Send(Edit(0, world_.agents[0]));
  Tick(90);
  EXPECT_EQ(for_agent_2_.size(), 1u);
  Tick(30);
  EXPECT_EQ(for_agent_2_.size(), 2u);
}

TEST_F(AnchorsProcessTest, MissingEditsAreRequestedAndTakenInOrder) {
  SendMap();
  Send(Edit(2, world_.agents[0]));
  EXPECT_EQ(process_.anchors().num_anchors(), 0u);
  Tick(1);
  ASSERT_EQ(requests_.size(), 1u);
  EXPECT_EQ(requests_[0].from_seq, 0);
  EXPECT_EQ(requests_[0].to_seq, 1);
  EXPECT_EQ(requests_[0].requester, "anchors");
  for (const int64_t seq : {1, 0}) {
    again_t again{};
    again.channel = "ANCHOR_EDIT";
    again.data = EncodeMessage(Edit(seq, world_.agents[0]));
    again.num_bytes = static_cast<int32_t>(again.data.size());
    PublishMessage(bus_, "AGAIN_anchors", again);
    bus_.Drain();
  }
  EXPECT_EQ(process_.anchors().num_anchors(), 3u);
  Tick(20);
  EXPECT_EQ(requests_.size(), 1u);
  EXPECT_EQ(status_.num_refused, 0);
}

TEST_F(AnchorsProcessTest, ADeletedOneIsSaidToBeGone) {
  SendMap();
  Send(Edit(0, world_.agents[0]));
  Tick(1);
  anchor_edit_t deleted = Edit(1, world_.agents[0]);
  deleted.anchor.created_utime = 100;
  deleted.revision = 2;
  deleted.deleted = 1;
  Send(deleted);
  Tick(30);
  ASSERT_GE(for_agent_2_.size(), 2u);
  EXPECT_EQ(for_agent_2_.back().state, anchor_t::STATE_GONE);
  EXPECT_EQ(for_agent_2_.size(), 1u + AnchorUpdates::kTimesGone);
}

TEST_F(AnchorsProcessTest, InAReplayTheEndSaysWhereTheyAre) {
  SendMap();
  Send(Edit(0, world_.agents[0]));
  EXPECT_TRUE(for_watchers_.empty());
  process_.Finish();
  bus_.Drain();
  EXPECT_EQ(for_watchers_.size(), 1u);
}

TEST_F(AnchorsProcessTest, AnAnchorAfterTheLastKeyframeOfItsMapDoesNotWaitForEver) {
  SendMap();
  Send(EditAfterTheMap());
  Tick(50);
  EXPECT_TRUE(for_agent_2_.empty()) << "a keyframe may still come";
  EXPECT_EQ(status_.pending, 1);
  Tick(250);
  EXPECT_EQ(status_.pending, 0);
  ASSERT_FALSE(for_agent_2_.empty());
  EXPECT_EQ(for_agent_2_[0].state, anchor_t::STATE_PLACED);
}

TEST_F(AnchorsProcessTest, SuchAnAnchorIsThereOnceTheJournalIsAfterARestart) {
  SendMap();
  Send(EditAfterTheMap());
  PublishMessage(bus_, "HAVE", have_t{});
  bus_.Drain();
  Tick(25);
  EXPECT_EQ(process_.anchors().num_placed(), 1u);
}

TEST_F(AnchorsProcessTest, RefusesWhatIsNotFromTheJournalOrNotAllowed) {
  SendMap();
  anchor_edit_t unnumbered = Edit(0, world_.agents[0]);
  unnumbered.seq = -1;
  Send(unnumbered);
  anchor_edit_t read_only = Edit(0, world_.agents[0]);
  read_only.may = anchor_edit_t::MAY_READ;
  Send(read_only);
  Tick(1);
  EXPECT_EQ(process_.anchors().num_anchors(), 0u);
  EXPECT_EQ(status_.num_refused, 2);
}

}  // namespace
}  // namespace pangea
