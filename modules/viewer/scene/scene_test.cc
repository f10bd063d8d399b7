#include "viewer/scene/scene.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "viewer/viewer_test_world.h"

namespace pangea::viewer {
namespace {

using testing::ElementsAre;
using testing::SizeIs;

// The kinds of what changed after a version, in order.
std::vector<ItemKind> ChangedAfter(const Scene& scene, uint64_t version) {
  std::vector<ItemKind> kinds;
  const auto& changes = scene.changes().by_version();
  for (auto it = changes.upper_bound(version); it != changes.end(); ++it) {
    kinds.push_back(it->second.kind);
  }
  return kinds;
}

TEST(Scene, AKeyframeComesOnce) {
  Scene scene;
  scene.Take(TestKeyframe(kOne, 0));
  const uint64_t version = scene.changes().version();
  scene.Take(TestKeyframe(kOne, 0));
  EXPECT_EQ(scene.changes().version(), version);
  EXPECT_THAT(scene.keyframes(), SizeIs(1));
  EXPECT_EQ(scene.maps()[0].num_keyframes, 1);
}

// A landmark is drawn only in its first keyframe. Points that are no landmarks are all drawn, and
// another map has landmarks of its own.
TEST(Scene, ALandmarkIsDrawnOnce) {
  Scene scene;
  const auto take = [&scene](const MapId& map, int32_t seq, const std::vector<int32_t>& landmarks) {
    ShownKeyframe keyframe = TestKeyframe(map, seq);
    keyframe.points.clear();
    for (const int32_t id : landmarks) {
      keyframe.points.push_back({{0, 0, 2}, id});
    }
    scene.Take(keyframe);
    std::vector<int32_t> shown;
    for (const ShownPoint& point : scene.keyframes().back().shown.points) {
      shown.push_back(point.landmark_id);
    }
    return shown;
  };
  EXPECT_THAT(take(kOne, 0, {4, 5, kNoLandmark}), ElementsAre(4, 5, kNoLandmark));
  EXPECT_THAT(take(kOne, 1, {5, 6, kNoLandmark}), ElementsAre(6, kNoLandmark));
  EXPECT_THAT(take(kTwo, 0, {5}), ElementsAre(5));
}

TEST(Scene, ASolvedPoseMayComeBeforeItsKeyframe) {
  Scene scene;
  scene.Take(TestState({kOne}, 0, 1));
  EXPECT_FALSE(scene.keyframes()[0].arrived);
  scene.Take(TestKeyframe(kOne, 0));
  EXPECT_THAT(scene.keyframes(), SizeIs(1));
  EXPECT_TRUE(scene.keyframes()[0].arrived);
  EXPECT_TRUE(scene.keyframes()[0].T_map_body.has_value());
}

TEST(Scene, AnOldStateChangesNothing) {
  Scene scene;
  scene.Take(TestState({kOne, kTwo}, 2, 7));
  const uint64_t version = scene.changes().version();
  scene.Take(TestState({kOne}, 2, 6));
  EXPECT_EQ(scene.changes().version(), version);
  EXPECT_EQ(scene.maps()[1].group, kOne);
}

TEST(Scene, OnlyWhatMovedIsSentAgain) {
  Scene scene;
  MapState state = TestState({kOne}, 2, 1);
  scene.Take(state);
  const uint64_t version = scene.changes().version();
  state.revision = 2;
  state.keyframes[1].T_map_body.t.z() += 0.01;
  state.keyframes[2].T_map_body.t.z() += 0.0001;
  scene.Take(state);
  EXPECT_THAT(ChangedAfter(scene, version), ElementsAre(ItemKind::kSolved));
}

// Moves too small to tell add up, and then are told.
TEST(Scene, ASlowDriftIsTold) {
  Scene scene;
  MapState state = TestState({kOne}, 0, 1);
  scene.Take(state);
  for (int i = 0; i < 100; ++i) {
    ++state.revision;
    state.keyframes[0].T_map_body.t.z() += 0.0001;
    scene.Take(state);
  }
  EXPECT_NEAR(scene.keyframes()[0].T_map_body->t.z(), 0.01, 0.0006);
}

TEST(Scene, FusionsAndSplitsAreNotedOnceWithTheirTime) {
  Scene scene;
  scene.SetTime(1);
  scene.Take(TestState({kOne}, 0, 1));
  EXPECT_THAT(scene.fusions(), SizeIs(0));
  scene.SetTime(2);
  scene.Take(TestState({kOne, kTwo}, 0, 2));
  scene.SetTime(3);
  scene.Take(TestState({kOne, kTwo}, 0, 3));
  scene.SetTime(4);
  scene.Take(TestState({kOne}, 0, 4));
  ASSERT_THAT(scene.fusions(), SizeIs(2));
  EXPECT_TRUE(scene.fusions()[0].fused);
  EXPECT_EQ(scene.fusions()[0].time_s, 2);
  EXPECT_THAT(scene.fusions()[0].maps, ElementsAre(kOne, kTwo));
  EXPECT_FALSE(scene.fusions()[1].fused);
  EXPECT_EQ(scene.fusions()[1].time_s, 4);
}

TEST(Scene, TheNewestResultOnACandidateCounts) {
  Scene scene;
  scene.Take(TestConstraint({kOne, 0}, {kTwo, 3}, false));
  scene.Take(TestConstraint({kOne, 0}, {kTwo, 3}, true));
  ASSERT_THAT(scene.constraints(), SizeIs(1));
  EXPECT_TRUE(scene.constraints()[0].accepted);
}

// The drift is what corrections add after the one that put the map into its group; what the
// correction leaves open about the position grows with the distance from the origin of odom.
TEST(Scene, DriftAndUncertaintyOfAnAgent) {
  Scene scene;
  scene.Take(TestKeyframe(kTwo, 0));
  scene.Take(TestKeyframe(kTwo, 10));
  Correction correction;
  correction.map = kTwo;
  correction.group = kOne;
  correction.revision = 1;
  correction.T_map_odom.t = {5, 5, 0};
  correction.covariance = Vector6d(1e-4, 1e-4, 1e-4, 1e-8, 1e-8, 1e-4).asDiagonal();
  scene.Take(correction);
  const SceneAgent& agent = scene.agents().at(2);
  EXPECT_EQ(scene.DriftOf(agent), 0);
  correction.revision = 2;
  correction.T_map_odom.t = {5, 5.25, 0};
  scene.Take(correction);
  EXPECT_NEAR(scene.DriftOf(agent), 0.25, 1e-12);

  // Ten metres out along x: the yaw's 0.01 rad is 0.1 m along y.
  const Eigen::Matrix3d covariance = scene.PositionCovariance(agent).value();
  EXPECT_NEAR(covariance(0, 0), 1e-4, 1e-9);
  EXPECT_NEAR(covariance(1, 1), 1e-4 + 100 * 1e-4, 1e-9);
  EXPECT_NEAR(covariance(0, 1), 0, 1e-9);
}

TEST(Scene, AnAgentWorksInTheMapItOpenedLast) {
  Scene scene;
  const MapId later = {1, kOne.opened_utime + 1};
  scene.Take(TestKeyframe(later, 0));
  scene.Take(TestKeyframe(kOne, 0));
  EXPECT_EQ(scene.maps()[static_cast<size_t>(scene.agents().at(1).map)].id, later);
}

// A process that invents names, or an agent that invents maps, fills nothing up.
TEST(Scene, IsBounded) {
  Scene scene;
  for (int i = 0; i < 1000; ++i) {
    ProcessHealth health;
    health.process = "process " + std::to_string(i);
    scene.Take(health);
    scene.Take(TestKeyframe({i + 1, 1}, 0));
  }
  EXPECT_THAT(scene.processes(), SizeIs(Scene::kMaxProcesses));
  EXPECT_THAT(scene.maps(), SizeIs(Scene::kMaxMaps));
  EXPECT_THAT(scene.agents(), SizeIs(Scene::kMaxAgents));
  EXPECT_EQ(scene.num_left_out(), 1000 - 200 + 1000 - 500 + 500 - 100);
}

}  // namespace
}  // namespace pangea::viewer
