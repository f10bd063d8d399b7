#include "global_ba/solver/ba_solver.h"

#include <gtest/gtest.h>

#include "global_ba/ba_test_world.h"
#include "global_ba/solver/ba_reference.h"

namespace pangea {
namespace {

constexpr double kLossScale = 2;

double SolveOwn(BaWorld* world) {
  BaOptions options;
  options.function_tolerance = 1e-13;
  BaSolver solver(*world, options, {.kind = RobustLoss::Kind::kHuber, .scale = kLossScale});
  for (int i = 0; i < 200 && solver.Iterate() == BaSolver::Outcome::kGoesOn; ++i) {
  }
  solver.ReadBack(world);
  return solver.cost();
}

// With fixed keyframes the gauge is fixed, and the minimum is unique.
BaWorld FixedWorld(uint64_t seed, bool cameras_fixed) {
  BaWorld world = MakeBaTestWorld({.seed = seed,
                                   .landmarks = 60,
                                   .outlier_share = 0.02,
                                   .edge_sigma_m = 0.002,
                                   .edge_scale_error = 0.01})
                      .start;
  for (BaKeyframe& keyframe : world.keyframes) {
    keyframe.fixed = keyframe.id.seq % 10 < 2;
    if (keyframe.id.seq % 10 == 6) {
      keyframe.preintegration.reset();
    }
  }
  for (BaCamera& camera : world.cameras) {
    camera.fixed = cameras_fixed;
    camera.edge_log_scale = cameras_fixed ? 0.005 : 0;
  }
  return world;
}

TEST(BaSolver, FindsTheMinimumOfCeres) {
  for (const bool cameras_fixed : {false, true}) {
    for (uint64_t seed = 1; seed <= 3; ++seed) {
      BaWorld own = FixedWorld(seed, cameras_fixed), reference = own;
      const double expected =
          SolveByCeres(BaOptions{}, new ceres::HuberLoss(kLossScale), &reference);
      EXPECT_NEAR(SolveOwn(&own) / expected, 1, 1e-7);
      for (size_t i = 0; i < own.keyframes.size(); ++i) {
        const KeyframeState &a = own.keyframes[i].state, &b = reference.keyframes[i].state;
        EXPECT_LT((a.T_map_body.Minus(b.T_map_body)).norm(), 1e-5);
        EXPECT_LT((a.v_map_body - b.v_map_body).norm(), 1e-4);
        EXPECT_LT((a.accel_bias - b.accel_bias).norm(), 1e-4);
      }
      for (size_t i = 0; i < own.cameras.size(); ++i) {
        EXPECT_NEAR(own.cameras[i].edge_log_scale, reference.cameras[i].edge_log_scale, 1e-5);
        EXPECT_LT(own.cameras[i].T_body_cam.Minus(reference.cameras[i].T_body_cam).norm(), 1e-5);
      }
    }
  }
}

// With all keyframes and cameras fixed, each landmark is independent.
TEST(BaSolver, MovesLandmarksWhereAllElseIsHeld) {
  BaWorld own = FixedWorld(1, true);
  for (BaKeyframe& keyframe : own.keyframes) {
    keyframe.fixed = true;
  }
  BaWorld reference = own;
  const double expected = SolveByCeres(BaOptions{}, new ceres::HuberLoss(kLossScale), &reference);
  EXPECT_NEAR(SolveOwn(&own) / expected, 1, 1e-7);
}

TEST(BaSolver, ALandmarkBehindAllItsCamerasStays) {
  BaWorld world = FixedWorld(1, true);
  const int landmark = world.observations.front().landmark;
  world.landmarks[landmark] = {0, 0, 1e4};
  BaSolver solver(world, BaOptions{}, {.kind = RobustLoss::Kind::kHuber, .scale = kLossScale});
  EXPECT_NE(solver.Iterate(), BaSolver::Outcome::kStuck);
  solver.ReadBack(&world);
  EXPECT_TRUE(world.landmarks[landmark].allFinite());
}

}  // namespace
}  // namespace pangea
