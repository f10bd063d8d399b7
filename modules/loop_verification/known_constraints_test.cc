#include "loop_verification/known_constraints.h"

#include <gtest/gtest.h>

#include <cmath>

namespace pangea {
namespace {

constexpr double kStep_m = 0.5;
const MapId kA{1, 1'000'000};
const MapId kB{2, 2'000'000};

// Keyframes in a row, kStep_m from each to the next.
void AddRow(const MapId& map, int count, SubmapStore* store) {
  for (int32_t seq = 0; seq < count; ++seq) {
    Keyframe keyframe;
    keyframe.id = {map, seq};
    keyframe.T_odom_body.t.x() = kStep_m * seq;
    if (seq > 0) {
      keyframe.edge.emplace();
      keyframe.edge->from_seq = seq - 1;
      keyframe.edge->T_from_this.t.x() = kStep_m;
    }
    store->Add(std::move(keyframe));
  }
}

Constraint Accepted(const KeyframeId& from, const KeyframeId& to, double sigma_m) {
  Constraint constraint;
  constraint.from = from;
  constraint.to = to;
  constraint.accepted = true;
  constraint.covariance = Matrix6d::Identity() * sigma_m * sigma_m;
  return constraint;
}

class KnownConstraintsTest : public testing::Test {
 protected:
  KnownConstraintsTest() {
    AddRow(kA, 80, &store_);
    AddRow(kB, 80, &store_);
  }

  double GainBits(const KeyframeId& a, const KeyframeId& b) const {
    return known_.NearbyOf(a, b, store_).gain_bits;
  }

  SubmapStore store_;
  KnownConstraints known_{
      KnownConstraintOptions{.min_gain_bits = 1, .drift_per_m = 0.02, .min_between_maps = 1}};
};

TEST_F(KnownConstraintsTest, WhereNothingIsKnownAnythingIsWorthIt) {
  EXPECT_TRUE(std::isinf(GainBits({kA, 10}, {kB, 10})));
  known_.Add(Accepted({kA, 10}, {kB, 10}, 0.02));
  EXPECT_TRUE(std::isinf(GainBits({kA, 10}, {kA, 40}))) << "other maps";
  EXPECT_TRUE(std::isinf(GainBits({kA, 10}, {kB, 60}))) << "too far away";
  EXPECT_FALSE(known_.IsRedundant({kA, 60}, {kB, 10}, store_));
}

TEST_F(KnownConstraintsTest, TheSecondAtOnePlaceBringsHalfABitTheThirdLess) {
  known_.Add(Accepted({kA, 10}, {kB, 10}, 0.02));
  EXPECT_NEAR(GainBits({kA, 10}, {kB, 10}), 0.5, 1e-9);
  EXPECT_NEAR(GainBits({kB, 10}, {kA, 10}), 0.5, 1e-9) << "either may be the query";
  known_.Add(Accepted({kA, 10}, {kB, 10}, 0.02));
  EXPECT_NEAR(GainBits({kA, 10}, {kB, 10}), 0.5 * std::log2(1.5), 1e-9);
  EXPECT_TRUE(known_.IsRedundant({kA, 10}, {kB, 10}, store_));
}

TEST_F(KnownConstraintsTest, OdometryBetweenAddsItsDriftOnBothSides) {
  known_.Add(Accepted({kA, 10}, {kB, 10}, 0.02));
  // 2 + 1 steps of 0.5 m, 2 % of them.
  const double drift_m = 0.02 * 1.5;
  const double expected = 0.5 * std::log2(1 + (0.02 * 0.02 + drift_m * drift_m) / (0.02 * 0.02));
  EXPECT_NEAR(GainBits({kA, 12}, {kB, 9}), expected, 1e-9);
  EXPECT_TRUE(known_.IsRedundant({kA, 11}, {kB, 11}, store_));
  EXPECT_FALSE(known_.IsRedundant({kA, 14}, {kB, 14}, store_));
}

// Whether two maps are one rests on them.
TEST_F(KnownConstraintsTest, TheFirstBetweenTwoMapsAreNeverRedundant) {
  KnownConstraints known({.min_between_maps = 2});
  known.Add(Accepted({kA, 10}, {kB, 10}, 0.02));
  EXPECT_FALSE(known.IsRedundant({kA, 10}, {kB, 11}, store_));
  known.Add(Accepted({kA, 10}, {kB, 12}, 0.02));
  EXPECT_TRUE(known.IsRedundant({kA, 10}, {kB, 11}, store_));
}

// A single one moves the map by whatever it is wrong.
TEST_F(KnownConstraintsTest, TheFirstAtOnePlaceOfAMapAreNeverRedundant) {
  KnownConstraints known({.min_nearby = 3});
  for (int i = 0; i < 3; ++i) {
    EXPECT_FALSE(known.IsRedundant({kA, 10}, {kA, 50}, store_)) << i;
    known.Add(Accepted({kA, 10}, {kA, 50}, 0.02));
  }
  EXPECT_TRUE(known.IsRedundant({kA, 11}, {kA, 51}, store_));
  EXPECT_FALSE(known.IsRedundant({kA, 45}, {kA, 51}, store_)) << "none within reach";
}

TEST_F(KnownConstraintsTest, AMapThatNoOdometryCrossesIsNotKnown) {
  Keyframe cut;  // begins a new piece of its map
  cut.id = {kB, 80};
  store_.Add(std::move(cut));
  known_.Add(Accepted({kA, 79}, {kB, 79}, 0.02));
  EXPECT_TRUE(std::isinf(GainBits({kA, 79}, {kB, 80})));
}

}  // namespace
}  // namespace pangea
