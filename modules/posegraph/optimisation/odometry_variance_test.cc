#include "posegraph/optimisation/odometry_variance.h"

#include <gtest/gtest.h>

#include "posegraph/graph/test_rows.h"

namespace pangea {
namespace {

// An error along x of this many standard deviations of the odometry.
PairEvidence::Innovation Off(double sigmas) {
  return {Vector4d(sigmas, 0, 0, 0), Matrix4d::Zero(), Matrix4d::Identity()};
}

TEST(OdometryVariance, BringsTheMedianToItsMean) {
  EXPECT_NEAR(OdometryVariance({Off(5.9), Off(6), Off(6.1)}), 9, 1e-3);
  EXPECT_NEAR(OdometryVariance({Off(0), Off(6), Off(1000)}), 9, 1e-3);
}

TEST(OdometryVariance, IsOfTheOdometryAlone) {
  PairEvidence::Innovation innovation = Off(6);
  innovation.measurement = 2 * Matrix4d::Identity();
  EXPECT_NEAR(OdometryVariance({innovation}), 7, 1e-3);
}

TEST(OdometryVariance, IsNeverBelowOne) {
  EXPECT_EQ(OdometryVariance({}), 1);
  EXPECT_EQ(OdometryVariance({Off(1.9)}), 1);
}

TEST(FitsOdometry, ALoopThatTheDriftExplains) {
  const GraphMaps maps = MakeRows(1, 12);
  const auto fits = [&](double off_m) {
    return FitsOdometry(LoopBetween({0, 0}, {0, 10}, {{0, 0, off_m}, 0}, maps), maps[0].chain);
  };
  EXPECT_TRUE(fits(0));
  EXPECT_TRUE(fits(0.3));  // at least 2 % of 10 m
  EXPECT_FALSE(fits(2));
}

TEST(Innovations, OfLoopsWithinMapsThatFitAndOfMerges) {
  const GraphMaps maps = MakeRows(2, 12);
  MapPairs pairs({});
  const Loop fits = LoopBetween({0, 0}, {0, 10}, {{0, 0, 0.1}, 0}, maps);
  const Loop wrong = LoopBetween({0, 1}, {0, 11}, {{0, 0, 2}, 0}, maps);
  const Loop between = LoopBetween({0, 0}, {1, 0}, {}, maps);
  pairs.Add(between, maps);
  const auto alone = Innovations({&fits, &wrong, &between}, pairs.All(), maps);
  ASSERT_EQ(alone.size(), 1u);
  EXPECT_NEAR(alone[0].error.norm(), 0.1, 1e-9);
  EXPECT_GT(alone[0].odometry(0, 0), 9e-4);  // ten edges

  for (const int node : {3, 6, 9}) {
    pairs.Add(LoopBetween({0, node}, {1, node}, {}, maps), maps);
  }
  ASSERT_TRUE(pairs.All()[0]->merged());
  EXPECT_GT(Innovations({&fits}, pairs.All(), maps).size(), 1u);
}

TEST(Innovations, AreEvenlySomeOfMany) {
  const GraphMaps maps = MakeRows(1, 12);
  const Loop loop = LoopBetween({0, 0}, {0, 10}, {}, maps);
  EXPECT_EQ(Innovations(std::vector<const Loop*>(150, &loop), {}, maps).size(), 150u);
  EXPECT_EQ(Innovations(std::vector<const Loop*>(500, &loop), {}, maps).size(), 167u);
}

}  // namespace
}  // namespace pangea
