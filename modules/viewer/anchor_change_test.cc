#include "viewer/anchor_change.h"

#include <gtest/gtest.h>

#include "viewer/viewer_test_world.h"

namespace pangea::viewer {
namespace {

constexpr int64_t kNow = 1'800'000'000'000'000;

// Two agents that are one group: on y = 0 and on y = 10, keyframes 0 to 9 at x = seq. Rotated
// bodies, so that a transform that is the wrong way round shows.
class AnchorChangeTest : public testing::Test {
 protected:
  AnchorChangeTest() {
    for (const MapId& map : {kOne, kTwo}) {
      for (int32_t seq = 0; seq < 10; ++seq) {
        scene_.Take(TestKeyframe(map, seq));
      }
    }
    MapState state = TestState({kOne, kTwo}, 9, 1);
    for (KeyframePose& pose : state.keyframes) {
      pose.T_map_body.q = ExpSo3({0.3, 0.1 * pose.id.seq, -1});
    }
    scene_.Take(state);
  }

  // Where the edit puts the anchor in the group's frame.
  Rigid3 Place(const AnchorEdit& edit) const {
    for (const SceneKeyframe& keyframe : scene_.keyframes()) {
      if (keyframe.shown.id == KeyframeId{edit.map, edit.keyframe_seq}) {
        return scene_.T_map_body(keyframe) * edit.T_ref_anchor;
      }
    }
    ADD_FAILURE() << "no such keyframe";
    return {};
  }

  Scene scene_;
};

TEST_F(AnchorChangeTest, ANewOneIsUprightAndHeldByTheNearestKeyframe) {
  AnchorChange change;
  change.name = "kettle";
  change.keyframe = 2;
  const Eigen::Vector3d p_map(7.2, 9, 1);
  change.p_body = scene_.T_map_body(scene_.keyframes()[2]).Inverse() * p_map;
  const AnchorEdit edit = EditOf(scene_, change, kNow).value();
  EXPECT_EQ(edit.anchor, (AnchorId{0, kNow}));
  EXPECT_EQ(edit.revision, 1);
  EXPECT_EQ(edit.agent_id, 0);
  EXPECT_EQ(edit.seq, -1);
  EXPECT_EQ(edit.name, "kettle");
  EXPECT_EQ(edit.placement, AnchorEdit::Placement::kKeyframe);
  EXPECT_EQ(edit.map, kTwo);
  EXPECT_EQ(edit.keyframe_seq, 7);
  EXPECT_EQ(edit.utime, 7'000'000);
  EXPECT_LT((Place(edit).t - p_map).norm(), 1e-12);
  EXPECT_LT(Place(edit).q.angularDistance(Eigen::Quaterniond::Identity()), 1e-7);
}

TEST_F(AnchorChangeTest, AMoveKeepsAllElse) {
  AnchorState known = TestAnchor(5, kOne);
  known.revision = 8;
  known.payload = "{}";
  known.T_odom_anchor.q = ExpSo3({0, 0, 1});
  scene_.Take(known);
  AnchorChange change;
  change.anchor = known.anchor;
  change.keyframe = 0;
  change.p_body = {0, 0, 1};
  const AnchorEdit edit = EditOf(scene_, change, kNow).value();
  EXPECT_EQ(edit.anchor, known.anchor);
  EXPECT_EQ(edit.revision, 9);
  EXPECT_EQ(edit.name, known.name);
  EXPECT_EQ(edit.payload, "{}");
  EXPECT_FALSE(edit.deleted);
  EXPECT_LT(Place(edit).q.angularDistance(known.T_odom_anchor.q), 1e-7);
  EXPECT_LT((Place(edit).t - scene_.T_map_body(scene_.keyframes()[0]) * change.p_body).norm(),
            1e-12);
}

// A new edit must have a name; an anchor of an earlier version may have none.
TEST_F(AnchorChangeTest, AMoveOfOneWithoutANameGivesItOne) {
  AnchorState known = TestAnchor(5, kOne);
  known.name.clear();
  scene_.Take(known);
  AnchorChange change;
  change.anchor = known.anchor;
  EXPECT_EQ(EditOf(scene_, change, kNow).value().name, "1/5");
}

TEST_F(AnchorChangeTest, ADeletedOneIsNotMoved) {
  scene_.Take(TestAnchor(5, kOne));
  AnchorChange change;
  change.anchor = AnchorId{1, 5};
  change.deleted = true;
  const AnchorEdit edit = EditOf(scene_, change, kNow).value();
  EXPECT_TRUE(edit.deleted);
  EXPECT_EQ(edit.revision, 2);
  EXPECT_EQ(edit.name, "anchor 5");
  EXPECT_EQ(edit.placement, AnchorEdit::Placement::kSame);
}

TEST_F(AnchorChangeTest, WhatIsNotThereIsNotChanged) {
  AnchorChange change;
  change.anchor = AnchorId{1, 6};
  EXPECT_FALSE(EditOf(scene_, change, kNow));
  change.anchor.reset();
  change.keyframe = 20;
  EXPECT_FALSE(EditOf(scene_, change, kNow));
  // Solved, but not come: its map has no odometry to hold an anchor by.
  scene_.Take(TestState({kOne, kTwo}, 10, 2));
  EXPECT_FALSE(EditOf(scene_, change, kNow));
}

}  // namespace
}  // namespace pangea::viewer
