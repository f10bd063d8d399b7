#include "global_ba/ba_problem.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "global_ba/ba_test_world.h"

namespace pangea {
namespace {

BaWorld Solved(const BaWorld& start, const BaOptions& options = {}) {
  BaProblem problem(start, options);
  while (problem.Advance()) {
  }
  return problem.world();
}

// Iterate to the minimum.
BaOptions ToTheEnd() {
  BaOptions options;
  options.function_tolerance = 1e-7;
  options.max_iterations = 40;
  return options;
}

BaWorld WithoutBiases(BaWorld world) {
  for (BaKeyframe& keyframe : world.keyframes) {
    keyframe.state.gyro_bias.setZero();
    keyframe.state.accel_bias.setZero();
  }
  return world;
}

TEST(BaProblem, FindsExactTruth) {
  const BaTestWorld world = MakeBaTestWorld({.noise = 0});
  ASSERT_GT(WorstError(world.start, world.truth), 0.05);
  EXPECT_LT(WorstError(Solved(world.start), world.truth), 5e-4);  // error of the integration itself
}

TEST(BaProblem, FindsTheScaleThatTheStartHasWrong) {
  for (uint64_t seed = 1; seed <= 3; ++seed) {
    const BaTestWorld world = MakeBaTestWorld({.seed = seed, .start_sigma_m = 0});
    const double true_length = PathLength(world.truth);
    ASSERT_NEAR(PathLength(world.start) / true_length, 1.02, 1e-6);
    EXPECT_NEAR(PathLength(Solved(world.start, ToTheEnd())) / true_length, 1, 2e-3);
  }
}

// Few and inaccurate rays: the information that the odometry has from many more images is kept.
TEST(BaProblem, KnowsNoLessThanItsOdometry) {
  for (uint64_t seed = 1; seed <= 3; ++seed) {
    BaTestWorld world =
        MakeBaTestWorld({.seed = seed, .landmarks = 25, .pixel_sigma = 3, .edge_sigma_m = 0.001});
    const double with = WorstError(Solved(world.start, ToTheEnd()), world.truth);
    for (BaKeyframe& keyframe : world.start.keyframes) {
      keyframe.edge.reset();
    }
    EXPECT_LT(with, 0.6 * WorstError(Solved(world.start, ToTheEnd()), world.truth));
  }
}

// An odometry with a wrong scale has the same error in all edges, which their covariances do not
// contain.
TEST(BaProblem, EdgesThatAreAllTooLongLeaveItsScaleAlone) {
  for (uint64_t seed = 1; seed <= 3; ++seed) {
    const BaTestWorld world =
        MakeBaTestWorld({.seed = seed, .edge_sigma_m = 0.001, .edge_scale_error = 0.02});
    const double true_length = PathLength(world.truth);
    EXPECT_NEAR(PathLength(Solved(world.start)) / true_length, 1, 4e-3);
  }
}

// The same if the odometry states its scale's sigma, for any error of the scale.
TEST(BaProblem, AMapThatIsNotMetricGetsItsScaleFromTheRest) {
  for (uint64_t seed = 1; seed <= 3; ++seed) {
    BaTestWorld world = MakeBaTestWorld(
        {.seed = seed, .edge_sigma_m = 0.001, .edge_scale_error = 0.15, .scale_error = 0.05});
    for (BaKeyframe& keyframe : world.start.keyframes) {
      keyframe.unknown_scale = 0.15;
    }
    EXPECT_NEAR(PathLength(Solved(world.start)) / PathLength(world.truth), 1, 4e-3);
  }
}

// Inaccurate edges take half of the IMU's weight at most.
TEST(BaProblem, CoarseEdgesDoNoHarm) {
  const BaTestWorld without = MakeBaTestWorld({});
  const BaTestWorld coarse = MakeBaTestWorld({.edge_sigma_m = 0.1});
  EXPECT_LT(WorstError(Solved(coarse.start), coarse.truth),
            1.5 * WorstError(Solved(without.start), without.truth));
}

TEST(BaProblem, OutliersDoNotMoveIt) {
  const BaTestWorld clean = MakeBaTestWorld({});
  const BaTestWorld dirty = MakeBaTestWorld({.outlier_share = 0.1});
  const BaWorld solved = Solved(dirty.start);
  EXPECT_LT(solved.observations.size(),
            0.95 * static_cast<double>(dirty.start.observations.size()));
  EXPECT_GT(solved.observations.size(), 0.8 * static_cast<double>(dirty.start.observations.size()));
  EXPECT_LT(WorstError(solved, dirty.truth), 2 * WorstError(Solved(clean.start), clean.truth));
}

// If the noise is as stated, twice the cost at the minimum is chi-squared with (residuals -
// parameters) degrees of freedom.
TEST(BaProblem, ResidualsAreWhatTheyClaim) {
  double sum = 0, degrees = 0;
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    const BaTestWorld world = MakeBaTestWorld({.seed = seed, .landmarks = 60});
    BaOptions options;
    options.loss_scale = 1e3;  // no robust loss
    options.max_chi2 = 1e6;
    options.function_tolerance = 1e-9;
    BaProblem problem(world.start, options);
    while (problem.Advance()) {
    }
    const size_t keyframes = world.start.keyframes.size();
    sum += 2 * problem.cost();
    degrees += 2.0 * static_cast<double>(world.start.observations.size()) +
               15.0 * static_cast<double>(keyframes - 2) + 2 * 6 -
               15.0 * static_cast<double>(keyframes) -
               3.0 * static_cast<double>(world.start.landmarks.size()) + 4;
  }
  EXPECT_NEAR(sum / degrees, 1, 0.05);
}

// The same for edges that have no IMU factor beside them: they have their full weight.
TEST(BaProblem, EdgesAloneAreWhatTheyClaim) {
  double sum = 0, degrees = 0;
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    const BaWorld truth =
        MakeBaTestWorld({.seed = seed, .landmarks = 0, .edge_sigma_m = 0.002, .imu = false}).truth;
    sum += 2 * BaSolver(WithoutBiases(truth), BaOptions{}, RobustLoss{}).cost();
    degrees += 6.0 * static_cast<double>(truth.keyframes.size() - 2);
  }
  EXPECT_NEAR(sum / degrees, 1, 0.1);
}

TEST(BaProblem, TheSameStartGivesTheSameBytes) {
  const BaTestWorld world = MakeBaTestWorld({.edge_sigma_m = 0.01});
  const BaWorld a = Solved(world.start), b = Solved(world.start);
  for (size_t i = 0; i < a.keyframes.size(); ++i) {
    EXPECT_EQ(a.keyframes[i].state.T_map_body.t, b.keyframes[i].state.T_map_body.t);
  }
}

// Only by their rotation: these flights have less information on their position than the prior.
TEST(BaProblem, FindsHowTheCamerasAreRotated) {
  BaTestWorld world = MakeBaTestWorld({});
  const Eigen::Quaterniond off = ExpSo3({0.004, -0.003, 0.003});
  for (BaCamera& camera : world.start.cameras) {
    camera = {.T_body_cam = {off * camera.T_body_cam.q, camera.T_body_cam.t}};
  }
  const BaWorld solved = Solved(world.start);
  for (size_t i = 0; i < solved.cameras.size(); ++i) {
    const Vector6d error = solved.cameras[i].T_body_cam.Minus(world.truth.cameras[i].T_body_cam);
    EXPECT_LT(error.tail<3>().norm(), 0.25 * LogSo3(off).norm());
  }
}

// With the same loss in both rounds, the second has nothing left to do. The prior on the cameras is
// about the odometry's extrinsics in both, not about the first round's result.
TEST(BaProblem, BothRoundsHaveOnePriorOnTheCameras) {
  BaWorld once = MakeBaTestWorld({}).start;
  for (BaCamera& camera : once.cameras) {
    Rigid3 T_body_cam = camera.T_body_cam;
    T_body_cam.t += Eigen::Vector3d(0.01, -0.01, 0.01);
    camera = {.T_body_cam = T_body_cam};
  }
  BaOptions options;
  options.loss_scale = 1e3;  // no robust loss
  options.max_chi2 = 1e6;
  options.function_tolerance = 1e-12;
  options.max_iterations = 100;
  const BaWorld twice = Solved(once, options);
  BaSolver solver(once, options, RobustLoss{.scale = options.loss_scale});
  while (solver.Iterate() == BaSolver::Outcome::kGoesOn) {
  }
  solver.ReadBack(&once);
  for (size_t i = 0; i < once.cameras.size(); ++i) {
    EXPECT_LT(once.cameras[i].T_body_cam.Minus(twice.cameras[i].T_body_cam).norm(), 1e-4);
  }
}

// So a part of a large world can be adjusted alone.
TEST(BaProblem, WhatMovesReturnsToTheMinimumBesideWhatIsHeld) {
  BaOptions to_the_end;
  to_the_end.function_tolerance = 1e-12;
  to_the_end.max_iterations = 100;
  const BaTestWorld world =
      MakeBaTestWorld({.outlier_share = 0.02, .edge_sigma_m = 0.001, .edge_scale_error = 0.01});
  const BaWorld solved = Solved(Solved(world.start, to_the_end), to_the_end);
  ASSERT_GT(std::abs(solved.cameras[0].edge_log_scale), 1e-3);
  BaWorld part = solved;
  std::mt19937_64 rng(1);
  std::normal_distribution<double> normal(0, 0.02);
  for (BaCamera& camera : part.cameras) {
    camera.fixed = true;
  }
  for (BaKeyframe& keyframe : part.keyframes) {
    keyframe.fixed = keyframe.id.seq % 10 < 5;
    if (!keyframe.fixed) {
      keyframe.state.T_map_body.t.x() += normal(rng);
      keyframe.state.v_map_body.y() += normal(rng);
      keyframe.state.accel_bias.setZero();
    }
  }
  const BaWorld found = Solved(part, to_the_end);
  for (size_t i = 0; i < found.keyframes.size(); ++i) {
    const KeyframeState &state = found.keyframes[i].state, &expected = solved.keyframes[i].state;
    const double tolerance = found.keyframes[i].fixed ? 0 : 1e-4;
    EXPECT_LE((state.T_map_body.t - expected.T_map_body.t).norm(), tolerance);
    EXPECT_LE((state.v_map_body - expected.v_map_body).norm(), 10 * tolerance);
    EXPECT_LE((state.accel_bias - expected.accel_bias).norm(), 10 * tolerance);
  }
}

// If the work is abandoned, the world is not worse than at the start.
TEST(BaProblem, CanBeLeftAfterAnyPiece) {
  const BaTestWorld world = MakeBaTestWorld({});
  BaProblem problem(world.start, BaOptions{});
  double cost = 1e300;
  while (problem.Advance() && problem.iterations() <= 4) {
    EXPECT_LE(problem.cost(), cost);
    cost = problem.cost();
  }
  EXPECT_LT(WorstError(problem.world(), world.truth), WorstError(world.start, world.truth));
}

}  // namespace
}  // namespace pangea
