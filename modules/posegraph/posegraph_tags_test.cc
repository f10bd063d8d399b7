// AprilTags in the pose graph: a constraint by a tag merges alone, look-alikes with different tags
// never merge, and a tag that was moved is noticed.

#include <gtest/gtest.h>

#include "core/testing/test_cameras.h"
#include "posegraph/posegraph.h"
#include "posegraph/posegraph_test_world.h"

namespace pangea {
namespace {

constexpr TagId kTag5{TagFamily::k36h11, 5}, kTag9{TagFamily::k36h11, 9};

// Adds the tag to the agent's keyframes in whose images it is.
void Hang(const TagId& tag, const Eigen::Vector3d& p_hall, SyntheticAgent* agent) {
  constexpr double kHalf_m = 0.1;
  for (size_t k = 0; k < agent->keyframes.size(); ++k) {
    Keyframe& keyframe = agent->keyframes[k];
    const Rigid3 T_hall_cam = agent->T_hall_body[k] * keyframe.camera.T_body_cam;
    const Eigen::Vector3d p_cam = T_hall_cam.Inverse() * p_hall;
    TagObservation seen{tag, {}};
    bool visible = p_cam.z() > 0.5 && p_cam.z() < 6;
    for (int i = 0; i < kTagCorners && visible; ++i) {
      const auto pixel = keyframe.camera.Project(
          p_cam + kHalf_m * Eigen::Vector3d(kTagCornerSigns[i][0], kTagCornerSigns[i][1], 0));
      visible = pixel && keyframe.camera.Contains(*pixel, 1);
      seen.corners[i] = pixel.value_or(Eigen::Vector2d::Zero()).cast<float>();
    }
    if (visible) {
      keyframe.tags.push_back(seen);
    }
  }
}

// A point in the hall that the keyframe looks at.
Eigen::Vector3d Ahead(const SyntheticWorld& world, const KeyframeId& id) {
  const CameraModel camera = EurocTestCamera();
  return world.T_hall_body(id) * (camera.T_body_cam * Eigen::Vector3d(0, 0, 3));
}

class PoseGraphTags : public testing::Test {
 protected:
  PoseGraphTags() : world_(MakeSyntheticWorld(PosesOnly(2, 100))) {
    for (SyntheticAgent& agent : world_.agents) {
      for (Keyframe& keyframe : agent.keyframes) {
        keyframe.camera = EurocTestCamera();
      }
    }
    pairs_ = OverlappingPairs(world_, 1.5, 25);
    std::erase_if(pairs_, [](const OverlappingPair& pair) { return pair.from.map == pair.to.map; });
  }

  Constraint ByTag(const OverlappingPair& pair, const Rigid3& displaced = {}) {
    Random random(StableHash(pair.from, pair.to, 2));
    Constraint constraint = MakeTrueConstraint(world_, pair.from, pair.to, {}, random);
    constraint.kind = PlaceKind::kTag;
    constraint.T_from_to =
        world_.T_hall_body(pair.from).Inverse() * displaced * world_.T_hall_body(pair.to);
    return constraint;
  }
  Constraint ByImage(const OverlappingPair& pair) {
    Random random(StableHash(pair.from, pair.to, 1));
    return MakeTrueConstraint(world_, pair.from, pair.to, {}, random);
  }
  // A tag where both keyframes of the pair look.
  void HangFor(const OverlappingPair& pair, const TagId& tag) {
    for (SyntheticAgent& agent : world_.agents) {
      Hang(tag, Ahead(world_, pair.from), &agent);
    }
  }
  bool BothSee(const OverlappingPair& pair, const TagId& tag) const {
    const auto sees = [&](const KeyframeId& id) {
      for (const SyntheticAgent& agent : world_.agents) {
        if (agent.map == id.map) {
          return std::ranges::count(agent.keyframes[id.seq].tags, tag, &TagObservation::tag) > 0;
        }
      }
      return false;
    };
    return sees(pair.from) && sees(pair.to);
  }
  std::vector<OverlappingPair> ThatSee(const TagId& tag) const {
    std::vector<OverlappingPair> seeing;
    std::ranges::copy_if(pairs_, std::back_inserter(seeing),
                         [&](const OverlappingPair& pair) { return BothSee(pair, tag); });
    return seeing;
  }

  SyntheticWorld world_;
  std::vector<OverlappingPair> pairs_;
};

TEST_F(PoseGraphTags, OneConstraintByATagMerges) {
  HangFor(pairs_[pairs_.size() / 2], kTag5);
  const auto seeing = ThatSee(kTag5);
  ASSERT_FALSE(seeing.empty());
  PoseGraph graph({});
  AddKeyframes(world_, &graph);
  Add(ByTag(seeing.front()), &graph);
  EXPECT_EQ(graph.counters().groups, 1);
  EXPECT_EQ(graph.counters().in_force, 1);
  EXPECT_TRUE(graph.MovedTags().empty());

  // The same after a restart.
  ByteRecordWriter writer;
  graph.Save(&writer);
  const std::vector<uint8_t> bytes = writer.Take();
  PoseGraph restored({});
  ByteRecordReader reader(bytes);
  ASSERT_TRUE(restored.Restore(&reader));
  EXPECT_EQ(restored.counters().groups, 1);
}

TEST_F(PoseGraphTags, AMovedTagIsNamedAndNoLongerMerges) {
  HangFor(pairs_[pairs_.size() / 2], kTag5);
  const auto seeing = ThatSee(kTag5);
  ASSERT_GE(seeing.size(), 3u);
  PoseGraph graph({});
  AddKeyframes(world_, &graph);
  const size_t stride = pairs_.size() / 20;
  for (size_t i = 0; i < pairs_.size(); i += stride) {
    Add(ByImage(pairs_[i]), &graph);
  }
  ASSERT_EQ(graph.counters().groups, 1);
  const Rigid3 moved(YawRotation(0.3), {2, 1, 0});
  Add(ByTag(seeing[0], moved), &graph);
  Add(ByTag(seeing[1], moved), &graph);
  graph.Finish();
  EXPECT_EQ(graph.counters().groups, 1);
  EXPECT_EQ(graph.counters().switched_off, 2);
  EXPECT_EQ(graph.MovedTags(), (std::set<TagId>{kTag5}));
  EXPECT_LT(JointAte(world_, graph.States()[0]), 0.1);
}

// A tag of known size, seen again and again by an agent that walks in rounds.
TEST(PoseGraphTagScale, LoopsByATagMakeALoneMapMetric) {
  constexpr double kLogScale = 0.08;
  SyntheticWorld world = MakeSyntheticWorld(PosesOnly(1, 200));
  std::vector<Constraint> constraints = MakeConstraints(world, 60, 0);
  Unscale(kLogScale, 0.1, &world.agents[0]);
  for (Keyframe& keyframe : world.agents[0].keyframes) {
    keyframe.tags = {{kTag5, {{{100, 200}, {200, 200}, {200, 100}, {100, 100}}}}};
  }
  PoseGraph by_images({});
  Solve(world, constraints, &by_images);
  EXPECT_LT(std::abs(by_images.LogScale(world.agents[0].map)), 0.001);
  for (Constraint& constraint : constraints) {
    constraint.kind = PlaceKind::kTag;
  }
  PoseGraph by_tag({});
  Solve(world, constraints, &by_tag);
  EXPECT_NEAR(by_tag.LogScale(world.agents[0].map), kLogScale, 0.005);
}

// All images agree; the tags say that these are two places.
TEST_F(PoseGraphTags, LookAlikesWithDifferentTagsNeverMerge) {
  const Eigen::Vector3d p_hall = Ahead(world_, pairs_[pairs_.size() / 2].from);
  Hang(kTag5, p_hall, &world_.agents[0]);
  Hang(kTag9, p_hall, &world_.agents[1]);
  PoseGraph graph({});
  AddKeyframes(world_, &graph);
  for (const OverlappingPair& pair : pairs_) {
    if (std::abs(pair.from.seq - pairs_[pairs_.size() / 2].from.seq) < 12) {
      Add(ByImage(pair), &graph);
      EXPECT_EQ(graph.counters().groups, 2);
    }
  }
  EXPECT_GT(graph.counters().unused, 5);
}

// Verification has refused what tags contradict; images elsewhere would merge.
TEST_F(PoseGraphTags, MapsOfWhichTagsContradictedCandidatesDoNotMerge) {
  PoseGraph graph({});
  AddKeyframes(world_, &graph);
  const size_t stride = pairs_.size() / 8;
  for (size_t i = 0; i < 2; ++i) {
    Constraint refused = ByImage(pairs_[i]);
    refused.accepted = false;
    refused.reason = kDifferentTags;
    Add(refused, &graph);
  }
  for (size_t i = 3; i < pairs_.size(); i += stride) {
    Add(ByImage(pairs_[i]), &graph);
    EXPECT_EQ(graph.counters().groups, 2);
  }
  // Unless they see a common tag.
  HangFor(pairs_[pairs_.size() / 2], kTag5);
  PoseGraph with_tag({});
  AddKeyframes(world_, &with_tag);
  for (size_t i = 0; i < 2; ++i) {
    Constraint refused = ByImage(pairs_[i]);
    refused.accepted = false;
    refused.reason = kDifferentTags;
    Add(refused, &with_tag);
  }
  Add(ByTag(ThatSee(kTag5).front()), &with_tag);
  EXPECT_EQ(with_tag.counters().groups, 1);
}

// Two tags on one wall, of which each agent saw one.
TEST_F(PoseGraphTags, DifferentTagsThatAreApartDoNotMatter) {
  const Eigen::Vector3d p_hall = Ahead(world_, pairs_[pairs_.size() / 2].from);
  Hang(kTag5, p_hall, &world_.agents[0]);
  Hang(kTag9, p_hall + Eigen::Vector3d(0, 0, 0.8), &world_.agents[1]);
  PoseGraph graph({});
  AddKeyframes(world_, &graph);
  for (const OverlappingPair& pair : pairs_) {
    Add(ByImage(pair), &graph);
  }
  EXPECT_EQ(graph.counters().groups, 1);
}

}  // namespace
}  // namespace pangea
