// Converts anchors to messages and back; bad messages are refused.

#include "messages/anchor_messages.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <vector>

namespace pangea {
namespace {

AnchorEdit Edit() {
  AnchorEdit edit;
  edit.anchor = {2, 1'700'000'000'000'000};
  edit.revision = 3;
  edit.agent_id = 4;
  edit.right = AnchorRight::kEditAll;
  edit.seq = 5;
  edit.name = "kettle";
  edit.payload = R"({"model": "kettle.glb"})";
  edit.placement = AnchorEdit::Placement::kPixel;
  edit.map = {4, 17};
  edit.keyframe_seq = 6;
  edit.utime = 7'000'000;
  edit.T_ref_anchor = {ExpSo3({0.1, 0.2, 0.3}), {1, 2, 3}};
  edit.T_odom_body = {ExpSo3({0, 0, 2}), {7, 8, 9}};
  edit.pixel = {376.5, 240.25};
  edit.covariance = 0.25 * Matrix6d::Identity();
  return edit;
}

AnchorState State() {
  return {{2, 18},
          3,
          4,
          true,
          "kettle",
          "{}",
          {5, 19},
          {1, 20},
          21,
          {ExpSo3({0, 0, 1}), {4, 5, 6}},
          0.5 * Matrix6d::Identity()};
}

TEST(AnchorMessages, AnEditThereAndBack) {
  const AnchorEdit edit = Edit();
  const auto parsed = Parse(ToMessage(edit));
  ASSERT_TRUE(parsed.value) << parsed.refused;
  EXPECT_EQ(parsed.value->anchor, edit.anchor);
  EXPECT_EQ(parsed.value->revision, edit.revision);
  EXPECT_EQ(parsed.value->agent_id, edit.agent_id);
  EXPECT_EQ(parsed.value->right, edit.right);
  EXPECT_EQ(parsed.value->seq, edit.seq);
  EXPECT_FALSE(parsed.value->deleted);
  EXPECT_EQ(parsed.value->name, edit.name);
  EXPECT_EQ(parsed.value->payload, edit.payload);
  EXPECT_EQ(parsed.value->placement, edit.placement);
  EXPECT_EQ(parsed.value->map, edit.map);
  EXPECT_EQ(parsed.value->keyframe_seq, edit.keyframe_seq);
  EXPECT_EQ(parsed.value->utime, edit.utime);
  EXPECT_EQ(parsed.value->pixel, edit.pixel);
  EXPECT_LT(parsed.value->T_ref_anchor.Minus(edit.T_ref_anchor).norm(), 1e-12);
  EXPECT_LT(parsed.value->T_odom_body->Minus(*edit.T_odom_body).norm(), 1e-12);
  EXPECT_EQ(*parsed.value->covariance, *edit.covariance);
}

TEST(AnchorMessages, AnEditThatMovesNothingNeedsNoPlace) {
  anchor_edit_t message = ToMessage(Edit());
  message.placement = anchor_edit_t::PLACEMENT_SAME;
  message.map = {};
  message.T_ref_anchor = {};
  EXPECT_TRUE(Parse(message).value);
}

TEST(AnchorMessages, AnEditAtAPixelNeedsNoTransform) {
  anchor_edit_t message = ToMessage(Edit());
  message.T_ref_anchor = {};
  EXPECT_TRUE(Parse(message).value);
  message.placement = anchor_edit_t::PLACEMENT_BODY;
  EXPECT_EQ(Parse(message).refused, "anchor edit: T_ref_anchor: quaternion is not of unit norm");
}

TEST(AnchorMessages, AStateThereAndBack) {
  const AnchorState state = State();
  const auto parsed = Parse(ToMessage(state));
  ASSERT_TRUE(parsed.value) << parsed.refused;
  EXPECT_EQ(parsed.value->anchor, state.anchor);
  EXPECT_EQ(parsed.value->map, state.map);
  EXPECT_EQ(parsed.value->group, state.group);
  EXPECT_EQ(parsed.value->group_revision, state.group_revision);
  EXPECT_TRUE(parsed.value->gone);
  EXPECT_EQ(parsed.value->covariance, state.covariance);
}

TEST(AnchorMessages, WhatIsShownThereAndBack) {
  const ShownAnchors shown{5, {1, 2}, {{{0, 3}, 4, {ExpSo3({0, 0, 1}), {1, 2, 3}}}}};
  const auto parsed = Parse(ToMessage(shown));
  ASSERT_TRUE(parsed.value) << parsed.refused;
  EXPECT_EQ(parsed.value->utime, 5);
  ASSERT_EQ(parsed.value->anchors.size(), 1u);
  EXPECT_EQ(parsed.value->anchors[0].anchor, (AnchorId{0, 3}));
}

TEST(AnchorMessages, EditsThatAreRefused) {
  const std::vector<std::function<void(anchor_edit_t&)>> damages = {
      [](anchor_edit_t& m) { m.anchor.agent_id = -1; },
      [](anchor_edit_t& m) { m.agent_id = 65536; },
      [](anchor_edit_t& m) { m.anchor.created_utime = -1; },
      [](anchor_edit_t& m) { m.revision = 0; },
      [](anchor_edit_t& m) { m.seq = -2; },
      [](anchor_edit_t& m) { m.may = 4; },
      [](anchor_edit_t& m) { m.placement = 0; },
      [](anchor_edit_t& m) { m.placement = 5; },
      [](anchor_edit_t& m) { m.name = std::string(kMaxAnchorName + 1, 'a'); },
      [](anchor_edit_t& m) { m.name = "two\nlines"; },
      [](anchor_edit_t& m) { m.payload = std::string(kMaxAnchorPayload + 1, 'a'); },
      [](anchor_edit_t& m) { m.payload = std::string("a\0b", 3); },
      [](anchor_edit_t& m) { m.keyframe_seq = -1; },
      [](anchor_edit_t& m) { m.utime = -1; },
      [](anchor_edit_t& m) { m.pixel[1] = NAN; },
      [](anchor_edit_t& m) { m.covariance[0] = -1; },
      [](anchor_edit_t& m) { m.T_ref_anchor.rotation.w = 7; },
      [](anchor_edit_t& m) { m.T_odom_body.rotation.w = 7; },
  };
  for (size_t i = 0; i < damages.size(); ++i) {
    anchor_edit_t message = ToMessage(Edit());
    damages[i](message);
    const auto parsed = Parse(message);
    EXPECT_FALSE(parsed.value) << "damage " << i;
    EXPECT_FALSE(parsed.refused.empty()) << "damage " << i;
  }
}

TEST(AnchorMessages, StatesThatAreRefused) {
  const std::vector<std::function<void(anchor_t&)>> damages = {
      [](anchor_t& m) { m.revision = 0; },
      [](anchor_t& m) { m.state = 0; },
      [](anchor_t& m) { m.payload = std::string("a\0b", 3); },
      [](anchor_t& m) { m.map.agent_id = 0; },
      [](anchor_t& m) { m.group.agent_id = 70000; },
      [](anchor_t& m) { m.group_revision = -1; },
      [](anchor_t& m) { m.covariance[7] = NAN; },
      [](anchor_t& m) { m.T_odom_anchor.translation.x = 1e9; },
  };
  for (size_t i = 0; i < damages.size(); ++i) {
    anchor_t message = ToMessage(State());
    damages[i](message);
    EXPECT_FALSE(Parse(message).value) << "damage " << i;
  }
}

}  // namespace
}  // namespace pangea
