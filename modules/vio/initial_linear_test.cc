// Gyro bias, time offset and the closed-form start.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "common/preintegration.h"
#include "common/testing/test_cameras.h"
#include "vio/initial_solution.h"
#include "vio/test_random.h"

namespace pangea::vio {
namespace {

using Eigen::Vector3d;

constexpr double kRaySigma = 0.5 / 400;
const Vector3d kGyroBias(0.02, -0.03, 0.01);
const Rigid3 kT_body_cam{LookingAhead() * ExpSo3({0.05, -0.03, 0.02}), {0.05, -0.02, 0.01}};

using Path = std::function<Rigid3(double)>;

Rigid3 Lively(double t) {
  return {ExpSo3({0.3 * std::sin(2 * t), 0.25 * std::sin(1.6 * t + 1), 0.4 * std::sin(1.2 * t)}),
          {0.5 * std::sin(1.3 * t), 0.6 * std::sin(1.7 * t), 0.2 * std::sin(2.1 * t)}};
}
Rigid3 TurningEvenly(double t) {
  return {ExpSo3({0, 0, 0.4 * t}), {0.5 * std::sin(1.3 * t), 0.6 * std::sin(1.7 * t), 0}};
}

Vector3d VelocityAt(const Path& path, double t) {
  constexpr double h = 1e-4;
  return (path(t + h).t - path(t - h).t) / (2 * h);
}

struct StartWorld {
  std::vector<ImuSample> samples;
  std::vector<StartFrame> frames;  // taken `late_s` later than they say
};

// 2 s of images at 10 Hz. The samples go on for `margin_s` to either side.
StartWorld Record(const Path& path, double late_s, double ray_sigma, double margin_s = 0.1) {
  constexpr double h = 1e-4, kFirst_s = 1, kSpan_s = 2;
  std::mt19937_64 rng(7);
  StartWorld world;
  for (double t = kFirst_s - margin_s; t <= kFirst_s + kSpan_s + margin_s + 1e-6; t += 0.005) {
    const Rigid3 now = path(t), before = path(t - h), after = path(t + h);
    const Vector3d accel = (after.t - 2 * now.t + before.t) / (h * h);
    world.samples.push_back(
        {std::llround(1e6 * t),
         LogSo3(before.q.conjugate() * after.q) / (2 * h) + kGyroBias + RandomVector(rng, 2e-3),
         now.q.conjugate() * (accel + Vector3d(0, 0, kGravity))});
  }
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<Vector3d> points;
  for (int i = 0; i < 80; ++i) {
    points.emplace_back(5 + 2 * uniform(rng), 4 * uniform(rng), 3 * uniform(rng));
  }
  for (int k = 0; k <= 20; ++k) {
    StartFrame frame;
    frame.utime = std::llround(1e6 * (kFirst_s + 0.1 * k));
    const Rigid3 T_cam_odom = (path(kFirst_s + 0.1 * k + late_s) * kT_body_cam).Inverse();
    for (int i = 0; i < 80; ++i) {
      const Vector3d p = T_cam_odom * points[i];
      const Vector3d noise = RandomVector(rng, ray_sigma);
      frame.rays[i] = p.head<2>() / p.z() + noise.head<2>();
    }
    if (k > 0) {
      frame.imu = SamplesBetween(world.samples, world.frames.back().utime, frame.utime);
    }
    world.frames.push_back(frame);
  }
  return world;
}

std::optional<double> OffsetOf(const StartWorld& world) {
  return SolveTimeOffset(world.frames, kT_body_cam, world.samples, ImuNoise{});
}

TEST(SolveTimeOffset, FindsHowMuchLaterTheImagesWereTaken) {
  for (const double late_s : {-0.045, -0.02, 0.0235, 0.03, 0.05}) {
    const auto found = OffsetOf(Record(Lively, late_s, kRaySigma));
    ASSERT_TRUE(found) << late_s;
    EXPECT_NEAR(*found, late_s, 0.0015);
  }
}

TEST(SolveTimeOffset, SaysNothingWhenNothingIsGained) {
  EXPECT_FALSE(OffsetOf(Record(Lively, 0, kRaySigma)));
  EXPECT_FALSE(OffsetOf(Record(Lively, 0.001, kRaySigma)));
}

// At a constant turn rate every offset explains the rotations as well.
TEST(SolveTimeOffset, SaysNothingWhenTheTurnRateDoesNotVary) {
  EXPECT_FALSE(OffsetOf(Record(TurningEvenly, 0.03, kRaySigma)));
}

TEST(SolveTimeOffset, SaysNothingBeyondWhatItSearches) {
  EXPECT_FALSE(OffsetOf(Record(Lively, 0.09, kRaySigma)));
}

TEST(SolveTimeOffset, SaysNothingWithoutEnoughSamplesOrTracks) {
  StartWorld world = Record(Lively, 0.03, kRaySigma);
  EXPECT_FALSE(SolveTimeOffset(world.frames, kT_body_cam, {}, ImuNoise{}));
  world.frames.resize(6);
  EXPECT_FALSE(OffsetOf(world));
}

TEST(SolveGyroBias, FindsTheBias) {
  const StartWorld world = Record(Lively, 0, kRaySigma);
  const auto bias = SolveGyroBias(world.frames, kT_body_cam, ImuNoise{});
  ASSERT_TRUE(bias);
  EXPECT_LT((*bias - kGyroBias).norm(), 2e-3);
}

TEST(SolveLinear, FindsVelocityGravityAndPoints) {
  const StartWorld world = Record(Lively, 0, 0);
  const auto start = SolveLinear(world.frames, kT_body_cam, ImuNoise{}, kGyroBias);
  ASSERT_TRUE(start);
  const Rigid3 T_odom_first = Lively(1);
  const auto R_first_odom = T_odom_first.q.conjugate();
  EXPECT_LT((start->v0 - R_first_odom * VelocityAt(Lively, 1)).norm(), 0.02);
  EXPECT_NEAR(start->gravity.norm(), kGravity, 1e-6);
  EXPECT_LT((start->gravity - R_first_odom * Vector3d(0, 0, -kGravity)).norm(), 0.1);
  ASSERT_EQ(start->T_first_body.size(), 21u);
  const Rigid3 T_first_last = T_odom_first.Inverse() * Lively(3);
  EXPECT_LT((start->T_first_body[20].t - T_first_last.t).norm(), 0.05);
  EXPECT_LT((start->v_first_body[20] - R_first_odom * VelocityAt(Lively, 3)).norm(), 0.05);
  EXPECT_EQ(start->p_first.size(), 80u);
}

}  // namespace
}  // namespace pangea::vio
