// Anchors of two agents: alone, fused, while the map moves, and after a fusion is undone.

#include "anchors/anchors.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "anchors/anchors_test_world.h"

namespace pangea {
namespace {

using Placement = AnchorEdit::Placement;

class AnchorsTest : public AnchorsTestWorld {
 protected:
  AnchorEdit Edit(int agent, int seq) const {
    AnchorEdit edit;
    edit.anchor = {agent + 1, 100 + seq};
    edit.agent_id = agent + 1;
    edit.right = AnchorRight::kEditOwn;
    edit.name = "kettle";
    edit.placement = Placement::kKeyframe;
    edit.map = map(agent);
    edit.keyframe_seq = seq;
    edit.T_ref_anchor.t = {2, 0, 0};
    return edit;
  }
  Eigen::Vector3d Truth(const AnchorEdit& edit) const {
    return world_.T_hall_body({edit.map, edit.keyframe_seq}) * edit.T_ref_anchor.t;
  }

  // Position in the hall at which an agent has the anchor, by its newest keyframe.
  Eigen::Vector3d SeenBy(int agent, const AnchorState& state) const {
    const Keyframe& newest = world_.agents[agent].keyframes.back();
    return world_.T_hall_body(newest.id) * (newest.T_odom_body.Inverse() * state.T_odom_anchor.t);
  }
};

TEST_F(AnchorsTest, AMapThatIsAloneHasItsOwnAnchors) {
  ASSERT_EQ(anchors_.Take(Edit(0, 18)), "");
  const auto own = anchors_.ForAgent(map(0));
  ASSERT_EQ(own.size(), 1u);
  EXPECT_EQ(own[0].name, "kettle");
  EXPECT_EQ(own[0].group_revision, 0);
  EXPECT_FALSE(own[0].gone);
  const Keyframe& keyframe = world_.agents[0].keyframes[18];
  EXPECT_LT((own[0].T_odom_anchor.t - keyframe.T_odom_body * Eigen::Vector3d(2, 0, 0)).norm(),
            1e-6);
  EXPECT_TRUE(anchors_.ForAgent(map(1)).empty());
}

TEST_F(AnchorsTest, TheOtherAgentHasItAtTheSamePlaceOnceFused) {
  const AnchorEdit edit = Edit(0, 18);
  anchors_.Take(edit);
  anchors_.Take(State({0, 1}, 1));
  for (const int agent : {0, 1}) {
    const auto states = anchors_.ForAgent(map(agent));
    ASSERT_EQ(states.size(), 1u);
    EXPECT_FALSE(states[0].gone);
    EXPECT_EQ(states[0].group_revision, 1);
    // The holds' odometry drifts by millimetres between keyframes.
    EXPECT_LT((SeenBy(agent, states[0]) - Truth(edit)).norm(), 0.03);
  }
}

TEST_F(AnchorsTest, ItFollowsTheMap) {
  const AnchorEdit edit = Edit(0, 10);
  anchors_.Take(edit);
  anchors_.Take(State({0, 1}, 1));
  const Rigid3 before = anchors_.All()[0].T_odom_anchor;
  const Rigid3 T{YawRotation(0.3), {1, 2, 3}};
  anchors_.Take(State({0, 1}, 2, T));
  EXPECT_LT((anchors_.All()[0].T_odom_anchor.t - T * before.t).norm(), 1e-9);
  // An older state changes nothing.
  anchors_.Take(State({0, 1}, 1));
  EXPECT_LT((anchors_.All()[0].T_odom_anchor.t - T * before.t).norm(), 1e-9);
}

TEST_F(AnchorsTest, ItFollowsTheKeyframesThatHoldIt) {
  anchors_.Take(Edit(0, 3));
  MapState state = State({0, 1}, 1);
  anchors_.Take(state);
  const Eigen::Vector3d before = anchors_.All()[0].T_odom_anchor.t;
  state.revision = 2;
  for (KeyframePose& pose : state.keyframes) {
    if (pose.id.map == map(0) && pose.id.seq < 15) {
      pose.T_map_body.t.x() += 0.5;
    }
  }
  anchors_.Take(state);
  EXPECT_NEAR(anchors_.All()[0].T_odom_anchor.t.x() - before.x(), 0.5, 1e-9);
}

TEST_F(AnchorsTest, AFusionThatIsUndoneTakesItAway) {
  anchors_.Take(Edit(0, 10));
  anchors_.Take(State({0, 1}, 1));
  EXPECT_FALSE(anchors_.ForAgent(map(1))[0].gone);
  anchors_.Take(State({0}, 2));
  anchors_.Take(State({1}, 3));
  EXPECT_TRUE(anchors_.ForAgent(map(1)).empty()) << "it was never told";
  EXPECT_TRUE(anchors_.ForAgent(map(1), {Edit(0, 10).anchor})[0].gone);
  EXPECT_FALSE(anchors_.ForAgent(map(0), {Edit(0, 10).anchor})[0].gone);
  anchors_.Take(State({0, 1}, 4));
  EXPECT_FALSE(anchors_.ForAgent(map(1), {Edit(0, 10).anchor})[0].gone);
}

TEST_F(AnchorsTest, MovedByAnotherItIsHeldByTheOthersKeyframes) {
  anchors_.Take(Edit(0, 10));
  AnchorEdit moved = Edit(1, 5);
  moved.anchor = Edit(0, 10).anchor;
  moved.revision = 2;
  EXPECT_NE(anchors_.Take(moved), "") << "its key allows its own only";
  moved.right = AnchorRight::kEditAll;
  EXPECT_EQ(anchors_.Take(moved), "");
  anchors_.Take(State({0, 1}, 1));
  const auto states = anchors_.ForAgent(map(0));
  EXPECT_LT((SeenBy(0, states[0]) - Truth(moved)).norm(), 0.03);
}

TEST_F(AnchorsTest, WaitsForItsKeyframe) {
  Anchors anchors{AnchorsOptions()};
  AnchorEdit edit = Edit(0, 1);
  EXPECT_EQ(anchors.Take(edit), "");
  EXPECT_EQ(anchors.num_waiting(), 1u);
  anchors.Take(world_.agents[0].keyframes[0]);
  EXPECT_TRUE(anchors.ForAgent(map(0)).empty());
  anchors.Take(world_.agents[0].keyframes[1]);
  EXPECT_EQ(anchors.num_waiting(), 0u);
  EXPECT_EQ(anchors.ForAgent(map(0)).size(), 1u);
}

// After a restart all edits may come before the keyframes.
TEST_F(AnchorsTest, AMoveThatFailsLeavesItWhereItWasInAnyOrder) {
  const AnchorEdit made = Edit(0, 5);
  AnchorEdit moved = made;
  moved.revision = 2;
  moved.placement = Placement::kPixel;
  moved.utime = world_.agents[0].keyframes[10].utime;
  moved.pixel = {300, 200};  // the world has no corners, so there is no surface
  for (const bool edits_first : {false, true}) {
    Anchors anchors{AnchorsOptions()};
    if (edits_first) {
      anchors.Take(made);
      anchors.Take(moved);
    }
    for (const Keyframe& keyframe : world_.agents[0].keyframes) {
      anchors.Take(keyframe);
    }
    if (!edits_first) {
      anchors.Take(made);
      anchors.Take(moved);
    }
    EXPECT_EQ(anchors.TakeNotPlaced().size(), 1u);
    ASSERT_EQ(anchors.All().size(), 1u) << edits_first;
    EXPECT_EQ(anchors.All()[0].revision, 2);
    const Keyframe& keyframe = world_.agents[0].keyframes[5];
    EXPECT_LT(
        (anchors.All()[0].T_odom_anchor.t - keyframe.T_odom_body * made.T_ref_anchor.t).norm(),
        0.03);
  }
}

TEST_F(AnchorsTest, ANewKeyframeLiesOnTheOdometryBehindTheMap) {
  const AnchorEdit edit = Edit(0, 19);
  anchors_.Take(edit);
  MapState state = State({0, 1}, 1);
  std::erase_if(state.keyframes, [this](const KeyframePose& pose) {
    return pose.id.map == map(0) && pose.id.seq > 14;
  });
  anchors_.Take(state);
  const auto states = anchors_.ForAgent(map(1));
  EXPECT_LT((SeenBy(1, states[0]) - Truth(edit)).norm(), 0.08);
}

TEST_F(AnchorsTest, OnlyTheNearestAreTold) {
  AnchorsOptions options;
  options.max_near = 3;
  options.near_m = 4;
  Anchors anchors(options);
  for (const Keyframe& keyframe : world_.agents[0].keyframes) {
    anchors.Take(keyframe);
  }
  for (int seq = 0; seq < 20; ++seq) {
    anchors.Take(Edit(0, seq));
  }
  const auto states = anchors.ForAgent(map(0));
  ASSERT_EQ(states.size(), 3u);
  const Eigen::Vector3d agent = world_.agents[0].keyframes.back().T_odom_body.t;
  for (const AnchorState& state : states) {
    EXPECT_LE((state.T_odom_anchor.t - agent).norm(), 4);
  }
  EXPECT_EQ(anchors.All().size(), 20u);
}

// An agent would show for ever what it is not told of any more: at a place that no correction of
// the map reaches, and also after a deletion or an undone fusion.
TEST_F(AnchorsTest, ThoseNoLongerNearAreGone) {
  AnchorsOptions options;
  options.near_m = 4;
  Anchors anchors(options);
  const AnchorEdit edit = Edit(0, 0);
  const std::set<AnchorId> told = {edit.anchor};
  anchors.Take(world_.agents[0].keyframes[0]);
  anchors.Take(edit);
  ASSERT_EQ(anchors.ForAgent(map(0)).size(), 1u);
  const Eigen::Vector3d p_odom = anchors.ForAgent(map(0))[0].T_odom_anchor.t;
  for (size_t i = 1; i < world_.agents[0].keyframes.size(); ++i) {
    const Keyframe& keyframe = world_.agents[0].keyframes[i];
    anchors.Take(keyframe);
    const double away_m = (p_odom - keyframe.T_odom_body.t).norm();
    const auto states = anchors.ForAgent(map(0), told);
    ASSERT_EQ(states.size(), 1u) << away_m;
    EXPECT_EQ(states[0].gone, away_m > 4.8) << away_m << " m; stays a little longer than it comes";
    EXPECT_EQ(anchors.ForAgent(map(0)).size(), away_m > 4 ? 0u : 1u) << away_m;
  }
  EXPECT_TRUE(anchors.ForAgent(map(0), told)[0].gone);
}

TEST_F(AnchorsTest, AllThatWereToldAndAreDeletedAreGone) {
  AnchorsOptions options;
  options.max_near = 3;
  Anchors anchors(options);
  for (const Keyframe& keyframe : world_.agents[0].keyframes) {
    anchors.Take(keyframe);
  }
  for (int seq = 0; seq < 20; ++seq) {
    anchors.Take(Edit(0, seq));
  }
  std::set<AnchorId> told;
  for (const AnchorState& state : anchors.ForAgent(map(0))) {
    told.insert(state.anchor);
  }
  ASSERT_EQ(told.size(), 3u);
  for (int seq = 0; seq < 20; ++seq) {
    AnchorEdit deleted = Edit(0, seq);
    deleted.revision = 2;
    deleted.deleted = true;
    anchors.Take(deleted);
  }
  std::set<AnchorId> gone;
  for (const AnchorState& state : anchors.ForAgent(map(0), told)) {
    EXPECT_TRUE(state.gone);
    gone.insert(state.anchor);
  }
  for (const AnchorId& id : told) {
    EXPECT_TRUE(gone.contains(id)) << ToString(id);
  }
}

// A sample of a Gaussian with independent components.
Vector6d Sample(const Vector6d& sigmas, std::mt19937_64& random) {
  std::normal_distribution<double> noise;
  Vector6d sample;
  for (int i = 0; i < 6; ++i) {
    sample[i] = sigmas[i] * noise(random);
  }
  return sample;
}

// NEES of an anchor of agent 1 in agent 2's odom frame. The editor's error fits its covariance, and
// the error of agent 2 in the map fits its correction's covariance.
double NeesAtTheOther(uint64_t seed) {
  SyntheticWorldOptions options;
  options.seed = seed;
  options.num_keyframes = 20;
  options.with_corners = false;
  const SyntheticWorld world = MakeSyntheticWorld(options);
  const SyntheticAgent &maker = world.agents[0], &other = world.agents[1];
  std::mt19937_64 random(seed);
  const Vector6d placed_sigmas{0.02, 0.01, 0.03, 0.02, 0.01, 0.02};
  const Vector6d correction_sigmas{0.03, 0.05, 0.02, 0.001, 0.001, 0.03};

  const Keyframe& newest = other.keyframes.back();
  Correction correction;
  correction.map = other.map;
  correction.revision = 1;
  correction.T_map_odom = other.T_hall_body.back() * newest.T_odom_body.Inverse();
  correction.covariance = correction_sigmas.cwiseAbs2().asDiagonal();
  const Rigid3 wrong_T_map_odom = correction.T_map_odom.Plus(Sample(correction_sigmas, random));

  Anchors anchors{AnchorsOptions()};
  MapState state;
  state.group = maker.map;
  state.revision = 1;
  state.maps = {maker.map, other.map};
  for (size_t i = 0; i < maker.keyframes.size(); ++i) {
    anchors.Take(maker.keyframes[i]);
    anchors.Take(other.keyframes[i]);
    state.keyframes.push_back({maker.keyframes[i].id, 0, maker.T_hall_body[i]});
    state.keyframes.push_back(
        {other.keyframes[i].id, 0, wrong_T_map_odom * other.keyframes[i].T_odom_body});
  }
  anchors.Take(state);
  anchors.Take(correction);

  const Rigid3 truth{Eigen::Quaterniond::Identity(), {2, 0, 0}};
  AnchorEdit edit;
  edit.anchor = {1, 1};
  edit.agent_id = 1;
  edit.right = AnchorRight::kEditOwn;
  edit.placement = Placement::kKeyframe;
  edit.map = maker.map;
  edit.keyframe_seq = 10;
  edit.T_ref_anchor = truth.Plus(Sample(placed_sigmas, random));
  edit.covariance = placed_sigmas.cwiseAbs2().asDiagonal();
  EXPECT_EQ(anchors.Take(edit), "");
  const AnchorState seen = anchors.ForAgent(other.map)[0];
  const Rigid3 T_odom_anchor =
      correction.T_map_odom.Inverse() * world.T_hall_body({edit.map, 10}) * truth;
  const Vector6d wrong = seen.T_odom_anchor.Minus(T_odom_anchor);
  return wrong.dot(seen.covariance.llt().solve(wrong)) / 6;
}

TEST(AnchorCovariance, IsConsistent) {
  constexpr int kWorlds = 100;
  double nees = 0;
  for (int seed = 1; seed <= kWorlds; ++seed) {
    nees += NeesAtTheOther(seed) / kWorlds;
  }
  EXPECT_LT(nees, 1.25);
  EXPECT_GT(nees, 0.7);
}

}  // namespace
}  // namespace pangea
