#include "posegraph/pair_evidence.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "posegraph/graph/test_rows.h"

namespace pangea {
namespace {

constexpr int64_t kMaxCandidates = 600;
constexpr int kNumNodes = 20;
class PairEvidenceTest : public testing::Test {
 protected:
  // The next constraint, between the maps' n-th nodes.
  void Add(const Pose4& T) {
    const int node = static_cast<int>(next_id_ % kNumNodes);
    Add(T, node, node);
  }
  void Add(const Pose4& T, int node_a, int node_b) {
    const Loop loop = LoopBetween({0, node_a}, {1, node_b}, T, maps_);
    evidence_.Add({.id = next_id_++,
                   .node_a = node_a,
                   .node_b = node_b,
                   .relative = loop.relative,
                   .num_inliers = loop.num_inliers});
  }
  bool IsAgreeing(int64_t id) const {
    return std::ranges::binary_search(evidence_.decision().agreeing, id);
  }

  const GraphMaps maps_ = MakeRows(2, kNumNodes);
  PairEvidence evidence_{maps_[0].chain, maps_[1].chain, {}};
  int64_t next_id_ = 0;
};

// What agents see after that of each other must hold their maps together, too.
TEST_F(PairEvidenceTest, AMergeTakesFurtherConstraintsThatAgree) {
  while (next_id_ < kMaxCandidates) {
    Add(kT_0_1);
  }
  ASSERT_TRUE(evidence_.decision().merge);
  Add(kT_0_1);
  Add({{7, 3, 0.5}, 0.3});
  Add(kT_0_1);
  EXPECT_TRUE(IsAgreeing(kMaxCandidates));
  EXPECT_FALSE(IsAgreeing(kMaxCandidates + 1));
  EXPECT_TRUE(IsAgreeing(kMaxCandidates + 2));
  EXPECT_TRUE(evidence_.decision().merge);
  const std::vector<uint8_t> bytes = BytesOf(evidence_);
  PairEvidence restored(maps_[0].chain, maps_[1].chain, {});
  ByteRecordReader reader(bytes);
  ASSERT_TRUE(restored.Restore(&reader));
  EXPECT_EQ(restored.decision().agreeing, evidence_.decision().agreeing);
}

TEST_F(PairEvidenceTest, MapsMergeHoweverManyConstraintsDidNotAgreeBefore) {
  while (next_id_ < 2 * kMaxCandidates) {
    const auto n = static_cast<double>(next_id_);
    Add({{10 * n, -7 * n, 0}, n});
  }
  ASSERT_FALSE(evidence_.decision().merge);
  for (int i = 0; i < 6; ++i) {
    Add(kT_0_1);
  }
  EXPECT_TRUE(evidence_.decision().merge);
  EXPECT_EQ(evidence_.decision().agreeing.size(), 6u);
}

// Alignments that differ by far more than the constraints' sigmas (10 mm) are of the same place.
TEST_F(PairEvidenceTest, AnInaccurateConstraintIsNoRival) {
  for (const auto& [node_a, node_b] : {std::pair(0, 0), {0, 1}, {1, 1}}) {
    Add({kT_0_1.p + Eigen::Vector3d(0.17, 0, 0), kT_0_1.yaw}, node_a, node_b);
    Add(kT_0_1, node_a, node_b);
  }
  Add(kT_0_1, 1, 0);
  EXPECT_EQ(evidence_.decision().agreeing, (std::vector<int64_t>{1, 3, 5, 6}));
  EXPECT_EQ(evidence_.decision().rival_viewpoints, 0);
  EXPECT_TRUE(evidence_.decision().merge);
}

TEST_F(PairEvidenceTest, WhatUndoesAMergeIsAsMuchAsItRestsOn) {
  const Pose4 elsewhere{{7, 3, 0.5}, 0.3};
  for (int i = 0; i < 4; ++i) {
    Add(kT_0_1);
  }
  for (int i = 0; i < 3; ++i) {
    Add(elsewhere);
    EXPECT_TRUE(evidence_.decision().merge) << i;
  }
  Add(elsewhere);
  EXPECT_FALSE(evidence_.decision().merge);
  for (int i = 0; i < 3; ++i) {
    Add(kT_0_1);
    EXPECT_FALSE(evidence_.decision().merge) << "to merge takes twice the rivals";
  }
  Add(kT_0_1);
  EXPECT_TRUE(evidence_.decision().merge);
}

// The rivals are not merged because the hypothesis that they replace was.
TEST_F(PairEvidenceTest, AnotherHypothesisHasToEarnItsMerge) {
  for (int i = 0; i < 3; ++i) {
    Add(kT_0_1);
  }
  ASSERT_TRUE(evidence_.decision().merge);
  for (int i = 0; i < 5; ++i) {
    Add({{7, 3, 0.5}, 0.3});
    EXPECT_EQ(evidence_.decision().merge, i < 2) << i;
  }
  Add({{7, 3, 0.5}, 0.3});
  EXPECT_TRUE(evidence_.decision().merge);
  EXPECT_FALSE(IsAgreeing(0));
}

// Neighbours share their drift, and say nothing about it.
TEST_F(PairEvidenceTest, OfThreeConstraintsTheOuterTwoShowTheDrift) {
  const Pose4 drifted{kT_0_1.p + Eigen::Vector3d(0, 0.1, 0), kT_0_1.yaw};
  Add(kT_0_1, 0, 0);
  Add(kT_0_1, 1, 1);
  Add(drifted, 10, 10);
  ASSERT_EQ(evidence_.decision().agreeing.size(), 3u);
  const auto innovations = evidence_.Innovations();
  ASSERT_EQ(innovations.size(), 1u);
  EXPECT_NEAR(innovations[0].error.head<3>().norm(), 0.1, 1e-9);
}

TEST_F(PairEvidenceTest, ACheckpointWithAnUnknownAgreementIsRefused) {
  Add(kT_0_1);
  Add(kT_0_1);
  std::vector<uint8_t> bytes = BytesOf(evidence_);
  const std::vector<uint8_t> agreeing{2, 2, 0, 0, 0};  // the flag, then a count of two
  const auto flag = std::search(bytes.begin(), bytes.end(), agreeing.begin(), agreeing.end());
  ASSERT_NE(flag, bytes.end());
  *flag = 3;
  PairEvidence restored(maps_[0].chain, maps_[1].chain, {});
  ByteRecordReader reader(bytes);
  EXPECT_FALSE(restored.Restore(&reader));
}

}  // namespace
}  // namespace pangea
