#include "loop_verification/aligner.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <numbers>
#include <random>

#include "loop_verification/aligner_test_world.h"
#include "loop_verification/drift_gate.h"

namespace pangea {
namespace {

// The covariance must be honest: over many worlds, the NEES with 6 degrees of freedom has the mean
// 6. All errors are drawn from their stated distributions: pixels, depths, edges, and one scale per
// odometry, common to its depths and edges.
TEST(AlignerTest, ErrorsAreWhatTheCovarianceSays) {
  double nees = 0, error_m = 0;
  int accepted = 0;
  constexpr int kRuns = 40;
  LoopVerificationOptions options;
  options.ba.systematic_px = 0;  // this world has no such errors
  std::mt19937_64 random(1);
  std::normal_distribution<double> log_scale(0, kWindowScaleSigma);
  for (int run = 0; run < kRuns; ++run) {
    const auto room = MakeTestRoom({.seed = 100u + run});
    TestAgentOptions walk_m = FirstAgent(run), walk_c = SecondAgent(run);
    walk_m.log_scale = log_scale(random);
    walk_c.log_scale = log_scale(random);
    const TestAgent m = RunTestAgent(room, walk_m);
    const TestAgent c = RunTestAgent(room, walk_c);
    const Constraint constraint =
        Align(c, 9, m, 10, MakeTestCandidate(c, 9, m, 10, 40, 15), options);
    if (!constraint.accepted) {
      continue;
    }
    ++accepted;
    const Rigid3 truth = m.T_room_body[10].Inverse() * c.T_room_body[9];
    const Vector6d error = constraint.T_from_to.Minus(truth);
    nees += error.dot(constraint.covariance.ldlt().solve(error));
    error_m += error.head<3>().norm();
  }
  EXPECT_GE(accepted, kRuns * 9 / 10);
  EXPECT_NEAR(nees / accepted, 6, 1.6);  // three standard deviations of the mean
  EXPECT_LT(error_m / accepted, 0.02);
}

TEST(AlignerTest, SameInputSameResult) {
  const auto room = MakeTestRoom({.seed = 3});
  const TestAgent m = RunTestAgent(room, FirstAgent(0));
  const TestAgent c = RunTestAgent(room, SecondAgent(0));
  const PlaceCandidate candidate = MakeTestCandidate(c, 9, m, 10, 40, 15);
  const Constraint first = Align(c, 9, m, 10, candidate);
  const Constraint second = Align(c, 9, m, 10, candidate);
  EXPECT_EQ(first.T_from_to.t, second.T_from_to.t);
  EXPECT_EQ(first.covariance, second.covariance);
}

// A few corners with a depth are enough: the others are found by projection.
TEST(AlignerTest, FewCandidateMatchesSuffice) {
  const auto room = MakeTestRoom({.seed = 4});
  const TestAgent m = RunTestAgent(room, FirstAgent(0));
  const TestAgent c = RunTestAgent(room, SecondAgent(0));
  const Constraint constraint = Align(c, 9, m, 10, MakeTestCandidate(c, 9, m, 10, 12, 12));
  EXPECT_TRUE(constraint.accepted) << constraint.reason;
}

// The tilt from the images is weighted by its covariance per axis: a rotation about the line of
// sight is less certain than about the other axes.
TEST(AlignerTest, TheTiltIsWeighedAboutItsAxis) {
  const auto room = MakeTestRoom({.seed = 6});
  const TestAgent m = RunTestAgent(room, FirstAgent(0));
  LoopVerificationOptions options;
  options.gravity_floor = 0;
  options.max_tilt_chi2 = 1e9;
  TestAgentOptions tilted = SecondAgent(0);
  tilted.odom_tilt = 0.018;
  const TestAgent c = RunTestAgent(room, tilted);
  KeyframeStore store;
  for (const TestAgent* agent : {&m, &c}) {
    for (Keyframe keyframe : agent->keyframes) {
      keyframe.roll_pitch_covariance.setZero();
      store.Add(keyframe);
    }
  }
  const auto frames_m = store.WindowUpTo(m.keyframes[10].id, Aligner::kNumKeyframes);
  const auto frames_c = store.WindowUpTo(c.keyframes[9].id, Aligner::kNumKeyframes);
  LoopVerificationReport report;
  const Constraint constraint = Aligner(options).Align(
      {frames_m, frames_c, {}}, MakeTestCandidate(c, 9, m, 10, 40, 0), std::nullopt, &report);
  ASSERT_TRUE(constraint.accepted) << constraint.reason;

  const Eigen::Quaterniond q_m = m.keyframes[10].T_odom_body.q, q_c = c.keyframes[9].T_odom_body.q;
  const Eigen::Quaterniond q_m_c = q_m * constraint.T_from_to.q * q_c.conjugate();
  const Eigen::Vector3d up = q_m_c * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d rotation =
      LogSo3(Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), up));
  const Eigen::Matrix3d of_rotation =
      q_m * constraint.covariance.bottomRightCorner<3, 3>() * q_m.conjugate();
  const Eigen::Matrix2d information = of_rotation.topLeftCorner<2, 2>().inverse();
  const double chi2 = rotation.head<2>().dot(information * rotation.head<2>());
  EXPECT_NEAR(report.Measured("max_tilt"), rotation.norm(), 1e-4);
  EXPECT_NEAR(report.Measured("max_tilt_chi2") / chi2, 1, 0.01);
  const Eigen::Vector2d across(-rotation.y(), rotation.x());
  EXPECT_GT(std::abs(across.dot(information * across) / chi2 - 1), 0.1) << "then axes would matter";
}

// Each limit, set to an impossible value, refuses in its own step a candidate that is accepted
// otherwise.
TEST(AlignerTest, EachBarIsObeyed) {
  const auto room = MakeTestRoom({.seed = 4});
  const TestAgent m = RunTestAgent(room, FirstAgent(0));
  const TestAgent c = RunTestAgent(room, SecondAgent(0));
  const PlaceCandidate candidate = MakeTestCandidate(c, 9, m, 10, 40, 15);
  LoopVerificationReport accepted;
  ASSERT_TRUE(Align(c, 9, m, 10, candidate, {}, &accepted).accepted);
  const auto refused = [&](auto bar, auto value) {
    LoopVerificationOptions options;
    options.*bar = value;
    LoopVerificationReport report;
    const Constraint constraint = Align(c, 9, m, 10, candidate, options, &report);
    return std::string(report.refused_by) + ": " + constraint.reason;
  };
  using Options = LoopVerificationOptions;
  EXPECT_EQ(refused(&Options::min_pnp_inliers, 10000), "PnP: too few matched points with a depth");
  EXPECT_EQ(refused(&Options::min_pnp_inliers,
                    static_cast<int>(accepted.Measured("min_pnp_inliers")) + 1),
            "PnP: PnP found too few inliers");
  EXPECT_EQ(refused(&Options::max_view_angle, 0.05), "views: views do not overlap");
  EXPECT_EQ(refused(&Options::max_distance_m, 0.1), "views: views do not overlap");
  const std::string in_two = "visibility in the two keyframes: ";
  EXPECT_EQ(refused(&Options::min_found, 1000), in_two + "too few points found by projection");
  EXPECT_EQ(refused(&Options::min_comparable, 10000),
            in_two + "too few points ought to be seen from both");
  EXPECT_EQ(refused(&Options::min_found_share, 1.1), in_two + "the surroundings contradict");
  EXPECT_EQ(refused(&Options::min_first_supported_share, 1.1),
            in_two + "the surroundings contradict");
  EXPECT_EQ(refused(&Options::min_inliers, 10000),
            "joint bundle adjustment: too few points found by projection");
  EXPECT_EQ(refused(&Options::max_tilt, 1e-9), "gravity: roll or pitch contradicts gravity");
  EXPECT_EQ(refused(&Options::max_tilt_chi2, 1e-9), "gravity: roll or pitch contradicts gravity");
  EXPECT_EQ(refused(&Options::min_inlier_ratio, 1.1), "inliers: too many outliers");
  EXPECT_EQ(refused(&Options::min_occupied_cells, 25), "inliers: inliers too close together");
  EXPECT_EQ(refused(&Options::max_sigma_m, 1e-6), "certainty: too uncertain");
  EXPECT_EQ(refused(&Options::max_sigma_rad, 1e-6), "certainty: too uncertain");
  EXPECT_EQ(refused(&Options::min_supported_share, 1.1),
            "visibility along the way: the surroundings contradict");
  EXPECT_EQ(refused(&Options::max_halves_chi2, 1e-9),
            "halves of the view: the halves of the view disagree");
}

TEST(AlignerTest, TheDriftGateIsObeyed) {
  const auto room = MakeTestRoom({.seed = 8});
  TestAgentOptions walk = FirstAgent(0);
  walk.num_keyframes = 80;
  walk.step_angle = 2 * std::numbers::pi / 68;
  const TestAgent agent = RunTestAgent(room, walk);
  KeyframeStore store;
  for (const Keyframe& keyframe : agent.keyframes) {
    store.Add(keyframe);
  }
  const PlaceCandidate candidate = MakeTestCandidate(agent, 76, agent, 9, 40, 10);
  const auto align = [&](const DriftGateOptions& options) {
    return Aligner({}).Align(
        {store.WindowUpTo({walk.map, 9}, 5), store.WindowUpTo({walk.map, 76}, 5), {}}, candidate,
        DriftGate(options, *store.PathBetween({walk.map, 9}, {walk.map, 76}),
                  agent.keyframes[76].T_odom_body.t));
  };
  EXPECT_TRUE(align({}).accepted) << align({}).reason;
  DriftGateOptions none;
  none.max_drift_m = none.max_drift_share = 0;
  EXPECT_EQ(align(none).reason, "more drift than odometry makes");
  DriftGateOptions no_yaw;
  no_yaw.max_yaw = no_yaw.max_yaw_per_m = 0;
  EXPECT_EQ(align(no_yaw).reason, "more drift than odometry makes");
}

// As on real phones: a keyframe has depths for only a few of its corners.
TEST(Aligner, FewDepthsAreEnoughWhereCornersAreMatchedBetweenNeighbours) {
  TestAgent m = RunTestAgent(MakeTestRoom({}), {});
  TestAgent c = RunTestAgent(MakeTestRoom({}), SecondAgent(0));
  for (TestAgent* agent : {&m, &c}) {
    for (Keyframe& keyframe : agent->keyframes) {
      keyframe.points.resize(std::min<size_t>(keyframe.points.size(), 4));
    }
  }
  const PlaceCandidate candidate = MakeTestCandidate(c, 9, m, 10, 40, 15);
  EXPECT_EQ(Align(c, 9, m, 10, candidate).reason, "");
  EXPECT_FALSE(Align(c, 9, m, 10, candidate, OnlyTracked()).accepted);
}

// The limits of the views are those of the constraint, not of the guess before the adjustment.
TEST(AlignerTest, LimitsTheDistanceOfTheResult) {
  const TestAgent m = RunTestAgent(MakeTestRoom({}), FirstAgent(0));
  const TestAgent c = RunTestAgent(MakeTestRoom({}), SecondAgent(0));
  LoopVerificationReport report;
  const Constraint constraint =
      Align(c, 9, m, 10, MakeTestCandidate(c, 9, m, 10, 60, 10), {}, &report);
  ASSERT_TRUE(constraint.accepted) << constraint.reason;
  EXPECT_NEAR(report.Measured("max_distance_m"), constraint.T_from_to.t.norm(), 1e-9);
}

}  // namespace
}  // namespace pangea
