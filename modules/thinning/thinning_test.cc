#include "thinning/thinning.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "anchors/odometry_track.h"
#include "anchors/placement.h"
#include "core/testing/synthetic_world.h"
#include "posegraph/publication/refinement.h"

namespace pangea {
namespace {

constexpr int64_t kDay_us = int64_t{24} * 3600 * 1'000'000;
constexpr int kVisits = 6;
constexpr int kKeyframes = 50;

// Visits of the same round through a hall, a day apart, with their constraints.
class ThinningTest : public ::testing::Test {
 protected:
  ThinningTest() { Make(1); }
  void Make(int seed, double step_m = 0.4) {
    SyntheticWorldOptions options;
    options.seed = seed;
    options.step_m = step_m;
    constraints_.clear();
    options.num_agents = kVisits;
    options.num_keyframes = kKeyframes;
    options.start_apart = 0;
    world_ = MakeSyntheticWorld(options);
    std::mt19937_64 random(seed);
    const std::vector<OverlappingPair> pairs = OverlappingPairs(world_, 1.0, 25);
    for (size_t i = 0; i < pairs.size(); i += 11) {
      constraints_.push_back(MakeTrueConstraint(world_, pairs[i].from, pairs[i].to, {}, random));
    }
  }

  Thinning MakeThinning(const ThinningOptions& options = {}) const {
    Thinning thinning({options, {}}, nullptr);
    for (size_t visit = 0; visit < world_.agents.size(); ++visit) {
      for (const Keyframe& keyframe : world_.agents[visit].keyframes) {
        thinning.Take(keyframe, static_cast<int64_t>(visit) * kDay_us);
      }
    }
    for (const Constraint& constraint : constraints_) {
      thinning.Take(constraint);
    }
    return thinning;
  }
  // An hour after the last visit.
  static constexpr int64_t kNow = (kVisits - 1) * kDay_us + kDay_us / 24;

  int64_t NumGone(const ThinnedMaps& thinned, int visit) const {
    return std::ranges::count_if(world_.agents[visit].keyframes, [&](const Keyframe& keyframe) {
      return thinned.gone.contains(keyframe.id);
    });
  }
  // The input of the pose graph after the thinning.
  std::vector<Keyframe> Staying(const ThinnedMaps& thinned) const {
    std::vector<Keyframe> staying;
    for (const SyntheticAgent& agent : world_.agents) {
      for (Keyframe keyframe : agent.keyframes) {
        if (const auto edge = thinned.edges.find(keyframe.id); edge != thinned.edges.end()) {
          keyframe.edge = edge->second.edge;
        }
        if (!thinned.gone.contains(keyframe.id)) {
          staying.push_back(std::move(keyframe));
        }
      }
    }
    return staying;
  }
  std::vector<Constraint> Constraints(const ThinnedMaps& thinned) const {
    std::vector<Constraint> all;
    for (const Constraint& one : constraints_) {
      if (!thinned.gone.contains(one.from) && !thinned.gone.contains(one.to)) {
        all.push_back(one);
      }
    }
    all.insert(all.end(), thinned.derived.begin(), thinned.derived.end());
    return all;
  }
  // The pose graph's solution for this input.
  std::vector<MapState> States(const ThinnedMaps& thinned) const {
    PoseGraph graph({});
    for (const Keyframe& keyframe : Staying(thinned)) {
      graph.AddKeyframe(keyframe);
    }
    for (const Constraint& constraint : Constraints(thinned)) {
      graph.AddConstraint(constraint);
    }
    graph.Finish();
    return graph.States();
  }
  Rigid3 PoseIn(const std::vector<MapState>& states, const KeyframeId& id) const {
    return std::ranges::find(states.front().keyframes, id, &KeyframePose::id)->T_map_body;
  }
  struct SolvedMaps {
    size_t groups = 0;
    double ate_m = 0;
  };
  // With the ATE of the keyframes that stay in `of`.
  SolvedMaps Solved(const ThinnedMaps& thinned, const ThinnedMaps& of) const {
    const std::vector<MapState> states = States(thinned);
    std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> positions;  // of the map, the truth
    for (const KeyframePose& pose : states.front().keyframes) {
      if (!of.gone.contains(pose.id)) {
        positions.emplace_back(pose.T_map_body.t, world_.T_hall_body(pose.id).t);
      }
    }
    const Rigid3 T_map_hall = FitYawAndShift(positions).ToRigid3();
    double sum_m2 = 0;
    for (const auto& [p_map, p_hall] : positions) {
      sum_m2 += (T_map_hall * p_hall - p_map).squaredNorm();
    }
    return {states.size(), std::sqrt(sum_m2 / static_cast<double>(positions.size()))};
  }

  SyntheticWorld world_;
  std::vector<Constraint> constraints_;
};

TEST_F(ThinningTest, TheOldestAndTheNewestStayAndTheMapNearlyAsGood) {
  double before_m = 0, after_m = 0;
  for (int seed = 1; seed <= 4; ++seed) {
    Make(seed);
    const ThinnedMaps thinned = MakeThinning().Thin(kNow);
    EXPECT_EQ(NumGone(thinned, 0), 0);
    EXPECT_EQ(NumGone(thinned, kVisits - 1), 0);
    EXPECT_GT(NumGone(thinned, 1) + NumGone(thinned, 2), 0.5 * kKeyframes);
    const SolvedMaps before = Solved({}, thinned), after = Solved(thinned, thinned);
    EXPECT_EQ(before.groups, 1);
    EXPECT_EQ(after.groups, 1);
    before_m += before.ate_m;
    after_m += after.ate_m;
  }
  EXPECT_LT(after_m, 1.2 * before_m);
}

TEST_F(ThinningTest, AMapThatNewerOnesShowIsGone) {
  Make(2);
  const ThinnedMaps thinned = MakeThinning().Thin(kNow);
  EXPECT_EQ(NumGone(thinned, 2), kKeyframes);
  EXPECT_LT(NumGone(thinned, 1), kKeyframes) << "others stay in part";
  EXPECT_EQ(Solved(thinned, thinned).groups, 1);
  for (const Constraint& constraint : Constraints(thinned)) {
    EXPECT_FALSE(thinned.gone.contains(constraint.from) || thinned.gone.contains(constraint.to));
  }
}

TEST_F(ThinningTest, EdgesLeadOverTheGaps) {
  const ThinnedMaps thinned = MakeThinning().Thin(kNow);
  EXPECT_FALSE(thinned.edges.empty());
  std::optional<KeyframeId> last;
  for (const Keyframe& keyframe : Staying(thinned)) {
    if (last && last->map == keyframe.id.map) {
      ASSERT_TRUE(keyframe.edge) << ToString(keyframe.id);
      EXPECT_EQ(keyframe.edge->from_seq, last->seq);
      const Rigid3 odometry =
          world_.agents[keyframe.id.map.agent_id - 1].keyframes[last->seq].T_odom_body.Inverse() *
          keyframe.T_odom_body;
      EXPECT_LT(keyframe.edge->T_from_this.Minus(odometry).norm(), 1e-6);
    } else {
      EXPECT_EQ(keyframe.id.seq, 0);
    }
    last = keyframe.id;
  }
}

// A keyframe that was lost by damage comes again, and is journalled behind later ones.
TEST_F(ThinningTest, TheOrderInTheJournalDoesNotMatter) {
  const ThinnedMaps in_order = MakeThinning().Thin(kNow);
  for (SyntheticAgent& agent : world_.agents) {
    std::ranges::rotate(agent.keyframes.begin() + 10, agent.keyframes.begin() + 12,
                        agent.keyframes.end());
  }
  const ThinnedMaps thinned = MakeThinning().Thin(kNow);
  EXPECT_EQ(thinned.gone, in_order.gone);
  ASSERT_EQ(thinned.edges.size(), in_order.edges.size());
  for (const auto& [id, joined] : in_order.edges) {
    EXPECT_EQ(thinned.edges.at(id).edge->from_seq, joined.edge->from_seq) << ToString(id);
  }
}

TEST_F(ThinningTest, DerivedConstraintsAreTrueToTheirCovariance) {
  const ThinnedMaps thinned = MakeThinning().Thin(kNow);
  const std::vector<MapState> before = States({});
  double nees = 0;
  for (const Constraint& constraint : thinned.derived) {
    const Rigid3 solved = PoseIn(before, constraint.from).Inverse() * PoseIn(before, constraint.to);
    EXPECT_LT(constraint.T_from_to.Minus(solved).norm(), 1e-6);
    const Rigid3 T =
        world_.T_hall_body(constraint.from).Inverse() * world_.T_hall_body(constraint.to);
    const Vector6d error = constraint.T_from_to.Minus(T);
    nees += error.dot(constraint.covariance.ldlt().solve(error)) / 6;
  }
  nees /= static_cast<double>(thinned.derived.size());
  EXPECT_GT(thinned.derived.size(), 20);
  // Below one: the poses use all measurements, the covariances only a tree of them.
  EXPECT_GT(nees, 0.1);
  EXPECT_LT(nees, 1.2);
}

// A constraint within a map that is not metric is in the map's own units, as its edges are.
TEST_F(ThinningTest, DerivedConstraintsHaveTheUnitsOfTheirMap) {
  constexpr double kLogScale = 0.2;
  Make(1, 0.8);
  for (size_t visit = 1; visit < world_.agents.size(); ++visit) {
    Unscale(kLogScale, 0.2, &world_.agents[visit]);
    Unscale(kLogScale, world_.agents[visit].map, &constraints_);
  }
  const ThinnedMaps thinned = MakeThinning().Thin(kNow);
  double told = 0, truth = 0;
  for (const Constraint& constraint : thinned.derived) {
    if (constraint.from.map == constraint.to.map && constraint.from.map != world_.agents[0].map) {
      told += constraint.T_from_to.t.norm();
      truth += (world_.T_hall_body(constraint.from).t - world_.T_hall_body(constraint.to).t).norm();
    }
  }
  ASSERT_GT(truth, 1);
  EXPECT_NEAR(told / truth, std::exp(-kLogScale), 0.01);
  const std::vector<MapState> states = States(thinned);
  ASSERT_EQ(states.size(), 1u);
  EXPECT_EQ(states[0].num_switched_off, 0);
}

// The poses are metric, and so must be the depths that say how near two views are.
TEST_F(ThinningTest, WhatStaysDoesNotDependOnTheUnitsOfAMap) {
  constexpr double kLogScale = 0.7;
  const auto metric = static_cast<double>(MakeThinning().Thin(kNow).gone.size());
  for (size_t visit = 1; visit < world_.agents.size(); ++visit) {
    Unscale(kLogScale, 0.7, &world_.agents[visit]);
    Unscale(kLogScale, world_.agents[visit].map, &constraints_);
  }
  const ThinnedMaps thinned = MakeThinning().Thin(kNow);
  ASSERT_EQ(States(thinned).size(), 1u);
  EXPECT_NEAR(static_cast<double>(thinned.gone.size()) / metric, 1, 0.1);
}

TEST_F(ThinningTest, AKeyframeGetsOnlySoManyDerivedConstraints) {
  ThinningOptions options;
  options.max_derived = 2;
  const ThinnedMaps thinned = MakeThinning(options).Thin(kNow);
  std::map<KeyframeId, int> count;
  for (const Constraint& constraint : thinned.derived) {
    ++count[constraint.from];
    ++count[constraint.to];
  }
  int beyond = 0;
  for (const auto& [id, derived] : count) {
    beyond += std::max(0, derived - options.max_derived);
  }
  EXPECT_FALSE(count.empty());
  // Each map that would otherwise have no constraint may have one beyond the limit.
  EXPECT_LT(beyond, 2 * kVisits);
}

TEST_F(ThinningTest, MapsOfTheLastHoursStayWhole) {
  ThinningOptions options;
  options.keep_hours = 24 * kVisits;
  EXPECT_TRUE(MakeThinning(options).Thin(kNow).gone.empty());
}

TEST_F(ThinningTest, WhatPlacesAnAnchorStays) {
  const MapId map = world_.agents[1].map;
  AnchorEdit edit;
  edit.anchor = {2, 7};
  edit.agent_id = 2;
  edit.right = AnchorRight::kEditOwn;
  edit.placement = AnchorEdit::Placement::kBody;
  edit.map = map;
  edit.utime = world_.agents[1].keyframes[25].utime - 1000;
  edit.T_ref_anchor.t = {2, 0, 0};
  const auto place = [&](const std::vector<Keyframe>& keyframes) {
    OdometryTrack track;
    for (const Keyframe& keyframe : keyframes) {
      if (keyframe.id.map == map) {
        track.Add(keyframe);
      }
    }
    return std::get<AnchorPlacement>(Place(edit, track, 8));
  };
  Thinning thinning = MakeThinning();
  thinning.Take(edit);
  const ThinnedMaps thinned = thinning.Thin(kNow);
  EXPECT_GT(NumGone(thinned, 1), kKeyframes / 3);
  const AnchorPlacement before = place(Staying({})), after = place(Staying(thinned));
  ASSERT_EQ(after.holds.size(), before.holds.size());
  for (size_t i = 0; i < before.holds.size(); ++i) {
    EXPECT_EQ(after.holds[i].seq, before.holds[i].seq);
    EXPECT_EQ(after.holds[i].weight, before.holds[i].weight);
    EXPECT_EQ(after.holds[i].T_body_anchor.t, before.holds[i].T_body_anchor.t);
  }
  EXPECT_EQ(after.covariance, before.covariance);
  // The anchor also keeps its position in the map, within its placement's uncertainty.
  const auto in_map = [&](const ThinnedMaps& of) {
    return PoseIn(States(of), {map, before.holds[0].seq}) * before.holds[0].T_body_anchor.t;
  };
  EXPECT_LT((in_map(thinned) - in_map({})).norm(),
            std::sqrt(before.covariance.topLeftCorner<3, 3>().trace()));
}

// The map may have no surface where the anchor was moved to: then it stays where it was.
TEST_F(ThinningTest, WhatPlacesAnAnchorThatWasMovedToASurfaceStaysToo) {
  AnchorEdit edit;
  edit.anchor = {2, 7};
  edit.agent_id = 2;
  edit.right = AnchorRight::kEditOwn;
  edit.placement = AnchorEdit::Placement::kKeyframe;
  edit.map = world_.agents[1].map;
  edit.keyframe_seq = 25;
  Thinning thinning = MakeThinning();
  thinning.Take(edit);
  edit.revision = 2;
  edit.placement = AnchorEdit::Placement::kPixel;
  edit.map = world_.agents[2].map;
  edit.utime = world_.agents[2].keyframes[25].utime;
  thinning.Take(edit);
  const ThinnedMaps thinned = thinning.Thin(kNow);
  for (const int agent : {1, 2}) {
    EXPECT_GT(NumGone(thinned, agent), kKeyframes / 3);
    EXPECT_FALSE(thinned.gone.contains({world_.agents[agent].map, 25})) << agent;
  }
}

TEST_F(ThinningTest, EvidenceBetweenMapsThatAreNotFusedStays) {
  // The second visit has one constraint, which is not enough for a fusion.
  const MapId alone = world_.agents[1].map;
  Constraint evidence;
  std::erase_if(constraints_, [&](const Constraint& constraint) {
    const bool of_it = constraint.from.map == alone || constraint.to.map == alone;
    if (of_it && constraint.from.map == world_.agents[0].map) {
      evidence = constraint;
    }
    return of_it;
  });
  constraints_.push_back(evidence);
  const ThinnedMaps thinned = MakeThinning().Thin(kNow);
  EXPECT_EQ(NumGone(thinned, 1), 0) << "of a group of its own";
  EXPECT_FALSE(thinned.gone.contains(evidence.from));
  EXPECT_EQ(Solved(thinned, {}).groups, 2);
}

TEST_F(ThinningTest, WithoutAnythingThereIsNothingToThin) {
  EXPECT_TRUE(Thinning({{}, {}}, nullptr).Thin(0).gone.empty());
}

}  // namespace
}  // namespace pangea
