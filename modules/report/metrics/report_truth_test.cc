#include "report/metrics/report_truth.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <random>

#include "report/metrics/report_counts.h"
#include "report/report_tables.h"

namespace pangea {
namespace {

const MapId kFirst{1, 100};
const MapId kSecond{2, 200};

// Correlated; sigmas from metres to centimetres, and from degrees to tenths of a degree.
Matrix6d SomeCovariance() {
  Matrix6d root = Matrix6d::Zero();
  root.diagonal() << 0.05, 0.02, 0.03, 0.004, 0.006, 0.008;
  root(1, 0) = 0.03;
  root(4, 0) = 0.005;
  root(5, 1) = -0.003;
  root(5, 3) = 0.006;
  return root * root.transpose();
}

Rigid3 TruePose(int i) {
  return {ExpSo3({0.02 * i, 0.3 * std::sin(i), 0.1 * i}), {0.1 * i, std::cos(0.2 * i), 1}};
}

// `scale`: sigmas of the noise, relative to those of the stated covariance.
std::vector<ConstraintWithTruth> Noisy(int count, double scale) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  const Matrix6d covariance = SomeCovariance();
  const Matrix6d root = covariance.llt().matrixL();
  std::vector<ConstraintWithTruth> constraints;
  for (int i = 0; i < count; ++i) {
    Vector6d noise;
    for (double& value : noise) {
      value = scale * normal(random);
    }
    ConstraintWithTruth known;
    known.T_from_to = TruePose(i);
    known.q_odom_from = ExpSo3({0.3, -0.5, 0.1 * i});
    known.constraint.T_from_to = known.T_from_to.Plus(root * noise);
    known.constraint.covariance = covariance;
    constraints.push_back(known);
  }
  return constraints;
}

TEST(ConstraintsTruth, AnHonestCovarianceHasNeesOfOnePerDimension) {
  const ConstraintsTruth truth = CheckConstraints(Noisy(800, 1));
  EXPECT_EQ(truth.checked, 800U);
  EXPECT_EQ(truth.wrong, 0U);
  EXPECT_EQ(truth.Precision(), 1.0);
  EXPECT_NEAR(truth.pose.mean, 1, 0.08);
  EXPECT_NEAR(truth.pose.median, 5.348 / 6, 0.08);
  EXPECT_NEAR(truth.position.mean, 1, 0.1);
  EXPECT_NEAR(truth.yaw.mean, 1, 0.2);
  EXPECT_NEAR(truth.yaw.median, 0.455, 0.12);
  for (const NormalisedError& error : {truth.pose, truth.position, truth.yaw}) {
    EXPECT_NEAR(error.share_above_99, 0.01, 0.012);
  }
  EXPECT_GT(truth.translation_p95_m, truth.translation_median_m);
}

TEST(ConstraintsTruth, AnOverconfidentCovarianceShows) {
  const ConstraintsTruth truth = CheckConstraints(Noisy(400, 2));
  EXPECT_NEAR(truth.pose.mean, 4, 0.5);
  EXPECT_NEAR(truth.position.mean, 4, 0.6);
  EXPECT_NEAR(truth.yaw.mean, 4, 1.0);
  EXPECT_GT(truth.pose.share_above_99, 0.4);
}

TEST(ConstraintsTruth, WrongOnesAreCountedByTranslationAndByRotation) {
  auto constraints = Noisy(10, 0);
  constraints[3].constraint.T_from_to.t.x() += 0.51;
  auto& rotated = constraints[7].constraint.T_from_to;
  rotated.q = ExpSo3({0, 0, 0.09}) * rotated.q;
  constraints[8].constraint.T_from_to.t.y() += 0.49;
  const ConstraintsTruth truth = CheckConstraints(constraints);
  EXPECT_EQ(truth.wrong, 2U);
  EXPECT_NEAR(*truth.Precision(), 0.8, 1e-12);
  EXPECT_NEAR(truth.translation_p95_m, 0.51, 1e-9);
  EXPECT_NEAR(truth.translation_median_m, 0, 1e-9);
}

TEST(ConstraintsTruth, NothingToCheckHasNoPrecision) {
  const ConstraintsTruth truth = CheckConstraints({});
  EXPECT_EQ(truth.checked, 0U);
  EXPECT_FALSE(truth.Precision());
}

// Keyframe i of both agents at second i, ground truth at 20 Hz to second 10.
TEST(ConstraintsTruth, OnlyAcceptedOnesWithGroundTruthAtBothEndsAreChecked) {
  CapturedSession session;
  std::map<MapId, Trajectory> trajectories;
  std::map<MapId, const Trajectory*> ground_truth;
  for (const MapId& map : {kFirst, kSecond}) {
    for (int i = 0; i < 12; ++i) {
      session.keyframes[{map, i}] = {i * 1'000'000, Rigid3{}, {}};
    }
    for (int i = 0; i <= 200; ++i) {
      const Rigid3 T{YawRotation(0.01 * i), {0.05 * i, 3.0 * map.agent_id, 0}};
      trajectories[map].push_back({i * 50'000, T});
    }
    ground_truth[map] = &trajectories[map];
  }
  const auto add = [&session](KeyframeId from, KeyframeId to, bool accepted) {
    Constraint constraint;
    constraint.from = from;
    constraint.to = to;
    constraint.accepted = accepted;
    session.constraints[constraint.Id()] = constraint;
  };
  add({kFirst, 2}, {kSecond, 4}, true);
  add({kFirst, 3}, {kSecond, 4}, false);
  add({kFirst, 2}, {kSecond, 11}, true);       // after the ground truth
  add({kFirst, 2}, {kSecond, 30}, true);       // a keyframe that was not captured
  add({kFirst, 2}, {MapId{3, 300}, 4}, true);  // an agent without ground truth
  // a map of the same agent, and of the same time, but of another recording
  const MapId earlier{kSecond.agent_id, 1};
  session.keyframes[{earlier, 4}] = {4'000'000, Rigid3{}, {}};
  add({kFirst, 3}, {earlier, 4}, true);
  const auto known = ConstraintsWithTruth(session, ground_truth);
  ASSERT_EQ(known.size(), 1U);
  const Rigid3 T_from{YawRotation(0.4), {2, 3, 0}};
  const Rigid3 T_to{YawRotation(0.8), {4, 6, 0}};
  EXPECT_LT(known[0].T_from_to.Minus(T_from.Inverse() * T_to).norm(), 1e-9);
}

// No verifier made the constraints that thinning derived.
TEST(ReportCounts, AreByWhatMadeTheConstraint) {
  CapturedSession session;
  for (const PlaceKind kind : {PlaceKind::kInter, PlaceKind::kIntra, PlaceKind::kDerived}) {
    Constraint constraint;
    constraint.kind = kind;
    constraint.accepted = true;
    session.constraints[static_cast<int64_t>(kind)] = constraint;
  }
  const ConstraintCounts counts = CountConstraints(session);
  EXPECT_EQ(counts.accepted_inter, 1);
  EXPECT_EQ(counts.accepted_intra, 1);
  EXPECT_EQ(counts.accepted_derived, 1);
  EXPECT_EQ(ConstraintsLine(session),
            "3 accepted (1 by fusion, 1 by inter_map_ba, 1 by thinning), 0 refused.");
}

}  // namespace
}  // namespace pangea
