#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "viewer/scene/scene.h"
#include "viewer/viewer_test_world.h"

namespace pangea::viewer {
namespace {

using testing::SizeIs;

TEST(SceneAnchors, ARepetitionChangesNothingAndAMoveDoes) {
  Scene scene;
  AnchorState anchor = TestAnchor(3, kOne);
  scene.Take(anchor);
  ASSERT_THAT(scene.anchors(), SizeIs(1));
  const uint64_t version = scene.changes().version();
  scene.Take(anchor);
  EXPECT_EQ(scene.changes().version(), version);
  anchor.group_revision = 5;
  anchor.T_odom_anchor.t.x() = 0.01;
  scene.Take(anchor);
  EXPECT_EQ(scene.changes().version(), version + 1);
  EXPECT_EQ(scene.anchors()[0].T_odom_anchor.t.x(), 0.01);
}

TEST(SceneAnchors, WhatIsOlderComesTooLate) {
  Scene scene;
  AnchorState anchor = TestAnchor(3, kOne);
  anchor.revision = 2;
  anchor.group_revision = 5;
  anchor.name = "new";
  scene.Take(anchor);
  AnchorState old = anchor;
  old.revision = 1;
  old.name = "old";
  scene.Take(old);
  EXPECT_EQ(scene.anchors()[0].name, "new");
  old = anchor;
  old.group_revision = 4;
  old.T_odom_anchor.t.x() = 1;
  scene.Take(old);
  EXPECT_EQ(scene.anchors()[0].T_odom_anchor.t.x(), 0);
  // Another group counts its own revisions.
  old.map = old.group = kTwo;
  scene.Take(old);
  EXPECT_EQ(scene.anchors()[0].map, kTwo);
}

TEST(SceneAnchors, WhatIsDeletedStaysSo) {
  Scene scene;
  AnchorState anchor = TestAnchor(3, kOne);
  scene.Take(anchor);
  EXPECT_NE(scene.FindAnchor(anchor.anchor), nullptr);
  AnchorState gone = anchor;
  gone.gone = true;
  scene.Take(gone);
  EXPECT_EQ(scene.FindAnchor(anchor.anchor), nullptr);
  scene.Take(anchor);
  EXPECT_EQ(scene.FindAnchor(anchor.anchor), nullptr);

  gone.anchor.created_utime = 4;
  scene.Take(gone);
  EXPECT_THAT(scene.anchors(), SizeIs(1)) << "never seen, so nothing to take away";
}

TEST(SceneAnchors, AreBounded) {
  Scene scene;
  const int64_t more = 7;
  for (int64_t n = 0; n < static_cast<int64_t>(Scene::kMaxAnchors) + more; ++n) {
    scene.Take(TestAnchor(n, kOne));
  }
  EXPECT_THAT(scene.anchors(), SizeIs(Scene::kMaxAnchors));
  EXPECT_EQ(scene.num_left_out(), more);
}

TEST(SceneAnchors, OfNoticesTheNewestIsKept) {
  Scene scene;
  scene.SetTime(2);
  scene.Tell("one");
  scene.SetTime(3);
  scene.Tell("two");
  EXPECT_EQ(scene.notice().text, "two");
  EXPECT_EQ(scene.notice().time_s, 3);
  EXPECT_THAT(scene.changes().by_version(), SizeIs(1));
}

// A keyframe that is solved in another group than its map is in now lies on the odometry.
TEST(SceneAnchors, WhereAKeyframeIsInItsGroup) {
  Scene scene;
  scene.Take(TestKeyframe(kTwo, 4));
  EXPECT_EQ(scene.T_map_body(scene.keyframes()[0]).t, Eigen::Vector3d(4, 0, 0));
  scene.Take(TestState({kOne, kTwo}, 4, 1));
  EXPECT_EQ(scene.T_map_body(scene.keyframes()[0]).t, Eigen::Vector3d(4, 10, 0));
  Correction correction;
  correction.map = correction.group = kTwo;
  correction.revision = 2;
  correction.T_map_odom.t.z() = 1;
  scene.Take(correction);
  EXPECT_EQ(scene.T_map_body(scene.keyframes()[0]).t, Eigen::Vector3d(4, 0, 1));
}

}  // namespace
}  // namespace pangea::viewer
