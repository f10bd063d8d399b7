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
    const Loop loop = LoopBetween({0, node}, {1, node}, T, maps_);
    evidence_.Add({.id = next_id_++,
                   .node_a = node,
                   .node_b = node,
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

}  // namespace
}  // namespace pangea
