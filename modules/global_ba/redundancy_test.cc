#include "global_ba/redundancy.h"

#include <gtest/gtest.h>

#include <set>

#include "global_ba/ba_test_world.h"

namespace pangea {
namespace {

// Keyframes every 0.2 s that all see nearly the same.
BaWorld Dense() { return MakeBaTestWorld({.keyframes = 20, .step_s = 0.2, .landmarks = 60}).truth; }

std::vector<Cull> None(const BaWorld& world) {
  return std::vector<Cull>(world.keyframes.size(), Cull::kIfRedundant);
}

TEST(Redundancy, CullsWhatOthersSee) {
  const BaWorld world = Dense();
  const BaWorld culled = WithoutRedundant(world, None(world));
  EXPECT_LT(culled.keyframes.size(), 0.5 * static_cast<double>(world.keyframes.size()));
  EXPECT_GT(culled.landmarks.size(), 0.9 * static_cast<double>(world.landmarks.size()));
}

TEST(Redundancy, WhatIsLeftIsOneChainWithoutLongGaps) {
  const BaWorld world = Dense();
  const BaWorld culled = WithoutRedundant(world, None(world));
  int beginnings = 0;
  for (int i = 0; i < static_cast<int>(culled.keyframes.size()); ++i) {
    const BaKeyframe& keyframe = culled.keyframes[i];
    if (keyframe.previous < 0) {
      ++beginnings;
      EXPECT_EQ(keyframe.id.seq, 0);
      continue;
    }
    const BaKeyframe& before = culled.keyframes[keyframe.previous];
    EXPECT_EQ(before.id.map, keyframe.id.map);
    const double gap_s = 1e-6 * static_cast<double>(keyframe.utime - before.utime);
    EXPECT_LE(gap_s, kMaxGap_s + 1e-9);
    EXPECT_NEAR(keyframe.preintegration->duration_s, gap_s, 1e-6);
  }
  EXPECT_EQ(beginnings, 2);
  EXPECT_EQ(culled.keyframes.back().id.seq, 19);
  for (const BaObservation& seen : culled.observations) {
    EXPECT_LT(seen.keyframe, static_cast<int>(culled.keyframes.size()));
    EXPECT_LT(seen.landmark, static_cast<int>(culled.landmarks.size()));
  }
}

TEST(Redundancy, EdgesReachOverWhatWasCulled) {
  const BaWorld world =
      MakeBaTestWorld({.step_s = 0.2, .landmarks = 60, .edge_sigma_m = 0.01, .noise = 0}).truth;
  const BaWorld culled = WithoutRedundant(world, None(world));
  ASSERT_LT(culled.keyframes.size(), world.keyframes.size());
  for (const BaKeyframe& keyframe : culled.keyframes) {
    if (keyframe.previous < 0) {
      continue;
    }
    const BaKeyframe& before = culled.keyframes[keyframe.previous];
    const Rigid3 T_true = before.state.T_map_body.Inverse() * keyframe.state.T_map_body;
    ASSERT_TRUE(keyframe.edge);
    EXPECT_LT(keyframe.edge->T_previous_this.Minus(T_true).norm(), 1e-9);
    const int steps = keyframe.id.seq - before.id.seq;
    EXPECT_GE(keyframe.edge->covariance(0, 0), 0.99e-4 * steps);
  }
}

TEST(Redundancy, AMissingEdgeIsNotBridged) {
  BaWorld world = MakeBaTestWorld({.step_s = 0.2, .landmarks = 60, .edge_sigma_m = 0.01}).truth;
  std::set<KeyframeId> without;  // every fifth keyframe has no edge to the one before
  for (BaKeyframe& keyframe : world.keyframes) {
    if (keyframe.id.seq % 5 == 0) {
      keyframe.edge.reset();
      without.insert(keyframe.id);
    }
  }
  int checked = 0;
  const BaWorld culled = WithoutRedundant(world, None(world));
  for (const BaKeyframe& keyframe : culled.keyframes) {
    if (keyframe.previous < 0) {
      continue;
    }
    bool complete = true;
    for (KeyframeId id = keyframe.id; id.seq > culled.keyframes[keyframe.previous].id.seq;
         --id.seq) {
      complete = complete && !without.contains(id);
    }
    EXPECT_EQ(keyframe.edge.has_value(), complete);
    checked += complete ? 0 : 1;
  }
  EXPECT_GT(checked, 0);
}

TEST(Redundancy, AMissingPreintegrationIsNotBridged) {
  BaWorld world = MakeBaTestWorld({.step_s = 0.2, .landmarks = 60, .edge_sigma_m = 0.01}).truth;
  std::set<KeyframeId> without;
  for (BaKeyframe& keyframe : world.keyframes) {
    if (keyframe.id.seq % 5 == 0 || keyframe.id.map.agent_id == 2) {
      keyframe.preintegration.reset();
      without.insert(keyframe.id);
    }
  }
  const BaWorld culled = WithoutRedundant(world, None(world));
  EXPECT_LT(culled.keyframes.size(), 0.5 * static_cast<double>(world.keyframes.size()));
  for (const BaKeyframe& keyframe : culled.keyframes) {
    if (keyframe.previous < 0) {
      continue;
    }
    const BaKeyframe& before = culled.keyframes[keyframe.previous];
    bool complete = true;
    for (KeyframeId id = keyframe.id; id.seq > before.id.seq; --id.seq) {
      complete = complete && !without.contains(id);
    }
    EXPECT_EQ(keyframe.preintegration.has_value(), complete);
    EXPECT_TRUE(keyframe.edge);
    EXPECT_LE(1e-6 * static_cast<double>(keyframe.utime - before.utime), kMaxGap_s);
  }
}

TEST(Redundancy, NeverWhatIsNeeded) {
  const BaWorld world = Dense();
  std::vector<Cull> cull = None(world);
  for (size_t i = 0; i < cull.size(); i += 3) {
    cull[i] = Cull::kNever;
  }
  const BaWorld culled = WithoutRedundant(world, cull);
  EXPECT_LT(culled.keyframes.size(), world.keyframes.size());
  std::set<KeyframeId> left;
  for (const BaKeyframe& keyframe : culled.keyframes) {
    left.insert(keyframe.id);
  }
  for (size_t i = 0; i < cull.size(); i += 3) {
    EXPECT_TRUE(left.contains(world.keyframes[i].id));
  }
}

TEST(Redundancy, WhatDoesNotStayIsBridgedHoweverLongTheGap) {
  const BaWorld world = MakeBaTestWorld({.edge_sigma_m = 0.01}).truth;
  std::vector<Cull> cull(world.keyframes.size(), Cull::kNever);
  for (size_t i = 0; i < cull.size(); ++i) {
    const int32_t seq = world.keyframes[i].id.seq;
    cull[i] = seq == 0 || seq == 19 || (seq > 4 && seq < 9) ? Cull::kAlways : Cull::kNever;
  }
  const BaWorld left = WithoutRedundant(world, cull);
  EXPECT_EQ(left.keyframes.size(), 2 * (20 - 6));
  for (const BaKeyframe& keyframe : left.keyframes) {
    const bool begins = keyframe.id.seq == 1;
    EXPECT_EQ(keyframe.previous < 0, begins);
    EXPECT_EQ(keyframe.preintegration.has_value(), !begins);
    EXPECT_EQ(keyframe.edge.has_value(), !begins);
    if (keyframe.id.seq == 9) {
      EXPECT_NEAR(keyframe.preintegration->duration_s, 5 * 0.5, 1e-6);
    }
  }
}

TEST(Redundancy, NotWhatOnlyFewSee) {
  BaWorld world = Dense();
  std::erase_if(world.observations, [](const BaObservation& seen) {
    return (seen.keyframe + seen.landmark) % 14 != 0;  // of 40 keyframes three at most see one
  });
  EXPECT_EQ(WithoutRedundant(world, None(world)).keyframes.size(), world.keyframes.size());
}

TEST(Redundancy, TheRestIsAsGoodAnEstimate) {
  const BaTestWorld world = MakeBaTestWorld({.keyframes = 30, .step_s = 0.2, .landmarks = 60});
  BaWorld truth = WithoutRedundant(world.truth, None(world.truth));
  BaProblem problem(WithoutRedundant(world.start, None(world.start)), BaOptions{});
  while (problem.Advance()) {
  }
  ASSERT_EQ(problem.world().keyframes.size(), truth.keyframes.size());
  EXPECT_LT(WorstError(problem.world(), truth), 0.02);
}

}  // namespace
}  // namespace pangea
