// Tests the spline, steps, generated paths and their IMU samples.

#include <gtest/gtest.h>

#include <algorithm>

#include "sim/imu_simulator.h"
#include "sim/path/path_generator.h"
#include "sim/path/path_steps.h"
#include "sim/path/spline_path.h"
#include "sim/random.h"
#include "sim/scene/route.h"
#include "sim/scene/test_scenes.h"

namespace pangea::sim {
namespace {

using Eigen::Vector3d;

TEST(SplinePath, FollowsThePosesItWasFittedTo) {
  const Trajectory poses = LivelyPath(10);
  const SplinePath path(poses, {});
  for (const StampedPose& pose : poses) {
    const PathState state = path.At(1000 * pose.utime);
    EXPECT_LT((state.T_ref_body.t - pose.T.t).norm(), 1e-4);
    EXPECT_LT(LogSo3(state.T_ref_body.q.conjugate() * pose.T.q).norm(), 1e-4);
  }
}

TEST(SplinePath, VelocityAccelerationAndRateAreItsDerivatives) {
  const SplinePath path(LivelyPath(10), {});
  const double h = 1e-4;
  for (double t = 0.5; t < 9.5; t += 0.0371) {
    const PathState before = path.AtSeconds(t - h);
    const PathState at = path.AtSeconds(t);
    const PathState after = path.AtSeconds(t + h);
    // Central differences: error of third derivatives times h^2, and rounding over h.
    EXPECT_LT(((after.T_ref_body.t - before.T_ref_body.t) / (2 * h) - at.v_ref_body).norm(), 1e-6);
    EXPECT_LT(((after.v_ref_body - before.v_ref_body) / (2 * h) - at.a_ref_body).norm(), 1e-5);
    const Vector3d rotation = LogSo3(before.T_ref_body.q.conjugate() * after.T_ref_body.q);
    EXPECT_LT((rotation / (2 * h) - at.omega_body).norm(), 1e-6);
  }
}

TEST(SplinePath, CarriesOverGapsAndLowRates) {
  Trajectory poses = LivelyPath(10);
  std::erase_if(poses, [&](const StampedPose& pose) {
    const int64_t since = pose.utime - 1'000'000'000;
    return since % 100'000 != 0 || (since > 4'000'000 && since < 4'300'000);
  });
  const SplinePath path(poses, {});
  for (const StampedPose& pose : LivelyPath(10)) {
    EXPECT_LT((path.At(1000 * pose.utime).T_ref_body.t - pose.T.t).norm(), 0.02);
  }
}

TEST(PathSteps, AStepIsFoundAndSpread) {
  const Trajectory smooth = LivelyPath(12);
  Trajectory stepped = smooth;
  Rng rng(1, "jitter");
  const Vector3d step(0.1, -0.05, 0.03);
  const size_t at = 1200;
  for (size_t i = 0; i < stepped.size(); ++i) {
    stepped[i].T.t += Vector3d(rng.Normal(), rng.Normal(), rng.Normal()) * 2e-4;
    if (i >= at) {
      stepped[i].T.t += step;
    }
  }
  const auto found = FindSteps(stepped, {});
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].utime, stepped[at].utime);
  EXPECT_LT((found[0].offset - step).norm(), 2e-3);

  const Trajectory spread = SpreadSteps(stepped, {});
  double largest = 0;
  for (size_t i = 1; i < spread.size(); ++i) {
    largest = std::max(largest, (spread[i].T.t - spread[i - 1].T.t).norm());
  }
  EXPECT_LT(largest, 0.015);  // 5 ms at up to 2.2 m/s, plus the jitter
  // Far from the step both paths are equal.
  EXPECT_LT((spread[700].T.t - stepped[700].T.t).norm(), 1e-9);
  EXPECT_LT((spread[1700].T.t - stepped[1700].T.t).norm(), 1e-9);
  const auto largest_acceleration = [](const Trajectory& trajectory) {
    const SplinePath path(trajectory, {});
    double a = 0;
    for (double t = 0.5; t < 11.5; t += 0.005) {
      a = std::max(a, path.AtSeconds(t).a_ref_body.norm());
    }
    return a;
  };
  EXPECT_GT(largest_acceleration(stepped), 10);
  EXPECT_LT(largest_acceleration(spread), largest_acceleration(smooth) + 1.0);
}

TEST(PathSteps, FastSmoothMotionHasNone) { EXPECT_TRUE(FindSteps(LivelyPath(12), {}).empty()); }

TEST(Imu, ExactSamplesIntegrateBackToThePath) {
  const SplinePath path(LivelyPath(8), {});
  const SimulatedImu imu =
      SimulateImu(path, path.begin_ns() + 500'000'000, path.end_ns() - 500'000'000, {}, true, 1);
  PathState state = path.At(imu.stamps_ns.front());
  Rigid3 T = state.T_ref_body;
  Vector3d v = state.v_ref_body;
  const double dt = 0.005;
  for (size_t i = 1; i < imu.samples.size(); ++i) {
    // Trapezoid over each interval.
    const Eigen::Quaterniond next =
        T.q * ExpSo3(0.5 * dt * (imu.samples[i - 1].gyro + imu.samples[i].gyro));
    const Vector3d a = 0.5 * (T.q * imu.samples[i - 1].accel + next * imu.samples[i].accel) -
                       Vector3d(0, 0, kGravity);
    T.t += dt * v + 0.5 * dt * dt * a;
    v += dt * a;
    T.q = next.normalized();
  }
  state = path.At(imu.stamps_ns.back());
  EXPECT_LT((T.t - state.T_ref_body.t).norm(), 1e-3);  // after 7 s
  EXPECT_LT(LogSo3(T.q.conjugate() * state.T_ref_body.q).norm(), 1e-4);
}

TEST(Imu, NoiseAndBiasWalkHaveTheirDensities) {
  const SplinePath path(LivelyPath(60), {});
  const ImuNoise noise;
  const auto make = [&](bool perfect, uint64_t seed) {
    return SimulateImu(path, path.begin_ns(), path.end_ns(), noise, perfect, seed);
  };
  const SimulatedImu exact = make(true, 1);
  const SimulatedImu noisy = make(false, 1);
  Vector3d gyro2 = Vector3d::Zero();
  Vector3d accel2 = Vector3d::Zero();
  Vector3d walk2 = Vector3d::Zero();
  const size_t n = noisy.samples.size();
  for (size_t i = 0; i < n; ++i) {
    gyro2 += (noisy.samples[i].gyro - exact.samples[i].gyro - noisy.gyro_bias[i]).cwiseAbs2();
    accel2 += (noisy.samples[i].accel - exact.samples[i].accel - noisy.accel_bias[i]).cwiseAbs2();
    if (i > 0) {
      walk2 += (noisy.accel_bias[i] - noisy.accel_bias[i - 1]).cwiseAbs2();
    }
  }
  const double count = 3.0 * static_cast<double>(n);
  // 36,000 draws: their deviation is known to half a per cent.
  EXPECT_NEAR(std::sqrt(gyro2.sum() / count) / (noise.gyro_noise_density * std::sqrt(200)), 1,
              0.02);
  EXPECT_NEAR(std::sqrt(accel2.sum() / count) / (noise.accel_noise_density * std::sqrt(200)), 1,
              0.02);
  EXPECT_NEAR(std::sqrt(walk2.sum() / count) / (noise.accel_random_walk / std::sqrt(200)), 1, 0.02);
  EXPECT_NE(make(false, 2).samples[0].gyro, noisy.samples[0].gyro);
  EXPECT_EQ(make(false, 1).samples[n - 1].gyro, noisy.samples[n - 1].gyro);
}

class GeneratedPaths : public testing::TestWithParam<std::tuple<Motion, SceneKind, int>> {};

TEST_P(GeneratedPaths, AreSmoothStayOnTheRouteAndGoRound) {
  const auto [motion, scene, seed] = GetParam();
  GeneratedPathOptions options{
      .motion = motion, .scene = scene, .seed = static_cast<uint64_t>(seed), .duration_s = 60};
  options.static_start_s = seed == 2 ? 3 : 0;
  const Trajectory trajectory = GeneratePath(options);
  const Route route = RouteOf(scene);
  const SplinePath path(trajectory, {});
  double length = 0;
  for (double t = 0.1; t < 59.9; t += 0.05) {
    const PathState state = path.AtSeconds(t);
    const Vector3d& p = state.T_ref_body.t;
    EXPECT_LT(state.a_ref_body.norm(), 15);
    EXPECT_LT(state.omega_body.norm(), 4);
    double nearest = 1e9;
    for (double phase = 0; phase < 6.29; phase += 0.01) {
      nearest = std::min(nearest, (p.head<2>() - route.At(phase)).cwiseAbs().maxCoeff());
    }
    EXPECT_LT(nearest, route.sideways_m + 0.02);
    EXPECT_GT(p.z(), route.low_m - 0.01);
    EXPECT_LT(p.z(), route.high_m + 0.01);
    length += 0.05 * state.v_ref_body.norm();
  }
  EXPECT_GT(length, 15);
  if (options.static_start_s > 0) {
    EXPECT_LT(path.AtSeconds(2.5).v_ref_body.norm(), 1e-3);
  } else {
    EXPECT_GT(path.AtSeconds(0.2).v_ref_body.norm(), 0.1);
  }
}

INSTANTIATE_TEST_SUITE_P(All, GeneratedPaths,
                         testing::Combine(testing::Values(Motion::kWalk, Motion::kFlight),
                                          testing::Values(SceneKind::kHall, SceneKind::kRoom),
                                          testing::Values(1, 2, 3)));

}  // namespace
}  // namespace pangea::sim
