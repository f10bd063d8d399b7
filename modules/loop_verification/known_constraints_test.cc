#include "loop_verification/known_constraints.h"

#include <gtest/gtest.h>

#include <cmath>

namespace pangea {
namespace {

constexpr double kStep_m = 0.5;
const MapId kA{1, 1'000'000};
const MapId kB{2, 2'000'000};
const MapId kC{3, 3'000'000};

// Keyframes in a row, with distances of kStep_m.
void AddRow(const MapId& map, int count, KeyframeStore* store) {
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
    AddRow(kC, 80, &store_);
  }

  double GainBits(const KeyframeId& query, const KeyframeId& match) const {
    return known_.NearbyOf(query, match, store_).gain_bits;
  }

  KeyframeStore store_;
  KnownConstraints known_{KnownConstraintOptions{.min_gain_bits = 1, .min_between_maps = 1}};
};

TEST_F(KnownConstraintsTest, WhereNothingIsKnownAnythingIsWorthIt) {
  EXPECT_TRUE(std::isinf(GainBits({kB, 11}, {kA, 10})));
  known_.Add(Accepted({kA, 10}, {kB, 10}, 0.02));
  EXPECT_TRUE(std::isinf(GainBits({kA, 40}, {kA, 10}))) << "other maps";
  EXPECT_TRUE(std::isinf(GainBits({kB, 60}, {kA, 10}))) << "too far away";
  EXPECT_FALSE(known_.IsRedundant({kB, 11}, {kA, 60}, store_));
}

TEST_F(KnownConstraintsTest, TheSecondAtOnePlaceBringsHalfABitTheThirdLess) {
  known_.Add(Accepted({kA, 10}, {kB, 9}, 1e-3));
  const double drift_m = 0.02 * kStep_m;
  const double information = 1 / (1e-6 + drift_m * drift_m);
  EXPECT_NEAR(GainBits({kB, 10}, {kA, 10}), 0.5 * std::log2(1 + 1e6 / information), 1e-9);
  known_.Add(Accepted({kA, 10}, {kB, 9}, 1e-3));
  EXPECT_NEAR(GainBits({kB, 10}, {kA, 10}), 0.5 * std::log2(1 + 1e6 / (2 * information)), 1e-9);
}

TEST_F(KnownConstraintsTest, OdometryBetweenAddsItsDriftOnBothSides) {
  known_.Add(Accepted({kA, 10}, {kB, 10}, 0.02));
  // The 1 + 2 steps are 1.5 m long, and the drift is 2 % of that.
  const double drift_m = 0.02 * 1.5;
  const double expected = 0.5 * std::log2(1 + (0.02 * 0.02 + drift_m * drift_m) / (0.02 * 0.02));
  EXPECT_NEAR(GainBits({kB, 12}, {kA, 9}), expected, 1e-9);
  EXPECT_TRUE(known_.IsRedundant({kB, 11}, {kA, 11}, store_));
  EXPECT_FALSE(known_.IsRedundant({kB, 14}, {kA, 14}, store_));
}

// One constraint to the third map, and one from there: their variances add, with the odometry.
TEST_F(KnownConstraintsTest, AThirdMapTellsWhereTheMatchIs) {
  known_.Add(Accepted({kA, 10}, {kB, 10}, 0.02));
  known_.Add(Accepted({kB, 12}, {kC, 10}, 0.02));
  // One step in C, and two in B; one in A.
  const double near = 0.02 * 0.02 + std::pow(0.02 * kStep_m, 2);
  const double far = 0.02 * 0.02 + std::pow(0.02 * 3 * kStep_m, 2);
  const double after = 1 / (1 / (near + far) + 1 / (0.02 * 0.02));
  const double tolerance = 0.01 * 0.01;
  EXPECT_NEAR(GainBits({kC, 11}, {kA, 11}),
              0.5 * std::log2((near + far + tolerance) / (after + tolerance)), 1e-9);
  EXPECT_TRUE(std::isinf(GainBits({kC, 10}, {kA, 11}))) << "of the same query";
  EXPECT_TRUE(std::isinf(GainBits({kC, 11}, {kA, 60}))) << "too far away";
}

// The candidate may be decided before these.
TEST_F(KnownConstraintsTest, OnlyWhatTheWayThroughAThirdMapRestsOnCounts) {
  known_.Add(Accepted({kA, 10}, {kB, 13}, 0.02));
  known_.Add(Accepted({kB, 12}, {kC, 10}, 0.02));
  EXPECT_TRUE(std::isinf(GainBits({kC, 11}, {kA, 11}))) << "C's match does not rest on B's query";
  known_.Add(Accepted({kC, 9}, {kB, 20}, 0.02));
  EXPECT_TRUE(std::isinf(GainBits({kC, 11}, {kA, 11}))) << "C's keyframe was not the query";
}

TEST_F(KnownConstraintsTest, WhatIsSavedAndRestoredDecidesTheSame) {
  known_.Add(Accepted({kA, 10}, {kB, 10}, 0.02));
  known_.Add(Accepted({kB, 12}, {kC, 10}, 0.02));
  const double gain = GainBits({kC, 11}, {kA, 11});
  ByteRecordWriter writer;
  known_.Save(&writer);
  const std::vector<uint8_t> bytes = writer.Take();
  ByteRecordReader reader(bytes);
  known_.Restore(&reader);
  EXPECT_EQ(GainBits({kC, 11}, {kA, 11}), gain);
}

// Otherwise the decision would depend on the order of verification.
TEST_F(KnownConstraintsTest, OnlyWhatACandidateRestsOnCounts) {
  known_.Add(Accepted({kA, 10}, {kB, 11}, 0.02));
  EXPECT_TRUE(std::isinf(GainBits({kB, 10}, {kA, 11})));
  EXPECT_TRUE(std::isinf(GainBits({kB, 11}, {kA, 11}))) << "of the same query";
  EXPECT_FALSE(std::isinf(GainBits({kB, 12}, {kA, 11})));
  EXPECT_TRUE(std::isinf(GainBits({kA, 13}, {kB, 11})));
  EXPECT_FALSE(std::isinf(GainBits({kA, 13}, {kB, 12}))) << "either may have been the query";
}

// The decision to merge two maps depends on the first constraints between them.
TEST_F(KnownConstraintsTest, TheFirstBetweenTwoMapsAreNeverRedundant) {
  KnownConstraints known({.min_between_maps = 2});
  known.Add(Accepted({kA, 10}, {kB, 10}, 0.02));
  EXPECT_FALSE(known.IsRedundant({kB, 11}, {kA, 10}, store_));
  known.Add(Accepted({kA, 12}, {kB, 10}, 0.02));
  EXPECT_TRUE(known.IsRedundant({kB, 11}, {kA, 10}, store_));
}

// A single wrong one displaces the map by its error.
TEST_F(KnownConstraintsTest, TheFirstAtOnePlaceOfAMapAreNeverRedundant) {
  KnownConstraints known({.min_nearby = 3});
  for (int i = 0; i < 3; ++i) {
    EXPECT_FALSE(known.IsRedundant({kA, 51}, {kA, 11}, store_)) << i;
    known.Add(Accepted({kA, 10}, {kA, 50}, 0.02));
  }
  EXPECT_TRUE(known.IsRedundant({kA, 51}, {kA, 11}, store_));
  EXPECT_FALSE(known.IsRedundant({kA, 51}, {kA, 45}, store_)) << "none within reach";
}

TEST_F(KnownConstraintsTest, AMapThatNoOdometryCrossesIsNotKnown) {
  Keyframe cut;  // begins a new piece of its map
  cut.id = {kB, 80};
  store_.Add(std::move(cut));
  known_.Add(Accepted({kA, 79}, {kB, 79}, 0.02));
  EXPECT_TRUE(std::isinf(GainBits({kB, 80}, {kA, 79})));
}

}  // namespace
}  // namespace pangea
