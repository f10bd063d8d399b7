#include "place_recognition/epipolar_check.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "core/rigid3.h"

namespace pangea {
namespace {

using Pairs = std::vector<std::pair<CornerRay, CornerRay>>;
constexpr double kSigma = 1.0 / 458;

struct Scene {
  Rigid3 T_b_a;
  Pairs pairs;
};

// Points in front of camera a (looking along x), optionally on one plane.
Scene MakeScene(int inliers, int outliers, const Rigid3& T_b_a, bool plane, double noise_sigmas,
                uint64_t seed) {
  std::mt19937_64 rng(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::normal_distribution<double> noise(0, noise_sigmas * kSigma);
  Scene scene{T_b_a, {}};
  const auto jitter = [&](const Eigen::Vector3d& p) {
    const Eigen::Vector3d d = p.normalized();
    const double x = noise(rng);
    const double y = noise(rng);
    return Eigen::Vector3d(
        (d + x * d.unitOrthogonal() + y * d.cross(d.unitOrthogonal())).normalized());
  };
  for (int i = 0; i < inliers; ++i) {
    const double y = 4 * uniform(rng);
    const double z = 2 * uniform(rng);
    const Eigen::Vector3d p_a(plane ? 6 + 0.3 * y : 6 + 3 * uniform(rng), y, z);
    const Eigen::Vector3d a = jitter(p_a);
    scene.pairs.push_back({{a, kSigma}, {jitter(T_b_a * p_a), kSigma}});
  }
  for (int i = 0; i < outliers; ++i) {
    const auto ray = [&] {
      const double y = 0.7 * uniform(rng);
      return Eigen::Vector3d(1, y, 0.45 * uniform(rng));
    };
    const Eigen::Vector3d a = ray().normalized();
    scene.pairs.push_back({{a, kSigma}, {(T_b_a.q * ray()).normalized(), kSigma}});
  }
  return scene;
}

double RotationError(const EpipolarModel& model, const Rigid3& truth) {
  return LogSo3(model.R_b_a * truth.q.conjugate()).norm();
}

TEST(SolveThreePairs, ExactPairsGiveTheTruthAmongTheSolutions) {
  std::mt19937_64 rng(1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  int found = 0;
  for (int trial = 0; trial < 100; ++trial) {
    const double yaw = 0.8 * uniform(rng);
    const double x = uniform(rng);
    const double y = uniform(rng);
    const Rigid3 T_b_a(YawRotation(yaw), Eigen::Vector3d(x, y, 0.5 * uniform(rng)));
    const Scene scene = MakeScene(3, 0, T_b_a, false, 0, trial + 10);
    for (const EpipolarModel& model : SolveThreePairs(scene.pairs, {0, 1, 2})) {
      for (const auto& [a, b] : scene.pairs) {
        EXPECT_LT(model.Residual(a, b), 1e-2);
      }
      if (RotationError(model, T_b_a) < 1e-4 && model.t_b_a.dot(T_b_a.t.normalized()) > 1 - 1e-4) {
        ++found;
        break;
      }
    }
  }
  EXPECT_GE(found, 99);
}

TEST(CheckEpipolar, FindsThePoseAmongMostlyWrongMatches) {
  const Rigid3 T_b_a(YawRotation(0.4), Eigen::Vector3d(0.5, -1.2, 0.2));
  const Scene scene = MakeScene(30, 60, T_b_a, false, 1.0, 3);
  const EpipolarResult result = CheckEpipolar(scene.pairs, 7);
  ASSERT_TRUE(result.accepted);
  EXPECT_LT(RotationError(result.model, T_b_a), 0.05);
  EXPECT_GT(result.model.t_b_a.dot(T_b_a.t.normalized()), 0.95);
  EXPECT_GE(
      std::count_if(result.inliers.begin(), result.inliers.end(), [](int i) { return i < 30; }),
      26);
}

TEST(CheckEpipolar, GravityMayBeOffByADegree) {
  const Rigid3 tilt(ExpSo3(Eigen::Vector3d(0.012, -0.014, 0)), Eigen::Vector3d::Zero());
  const Rigid3 T_b_a = tilt * Rigid3(YawRotation(-0.3), Eigen::Vector3d(0.4, 0.9, 0.1));
  const Scene scene = MakeScene(40, 40, T_b_a, false, 1.0, 4);
  const EpipolarResult result = CheckEpipolar(scene.pairs, 7);
  ASSERT_TRUE(result.accepted);
  EXPECT_GE(result.inliers.size(), 36u);
}

TEST(CheckEpipolar, PlanesAndRotationsInPlaceAreNotRefused) {
  const Rigid3 moved(YawRotation(0.2), Eigen::Vector3d(0.1, -0.8, 0.1));
  EXPECT_TRUE(CheckEpipolar(MakeScene(30, 20, moved, true, 1.0, 5).pairs, 7).accepted);
  const Rigid3 rotated(YawRotation(0.3), Eigen::Vector3d::Zero());
  EXPECT_TRUE(CheckEpipolar(MakeScene(30, 20, rotated, false, 1.0, 6).pairs, 7).accepted);
  EXPECT_TRUE(CheckEpipolar(MakeScene(30, 20, rotated, true, 1.0, 7).pairs, 7).accepted);
  EXPECT_TRUE(CheckEpipolar(MakeScene(30, 20, {}, false, 1.0, 8).pairs, 7).accepted);
}

TEST(CheckEpipolar, UnrelatedMatchesAreRefused) {
  int accepted = 0;
  for (int trial = 0; trial < 100; ++trial) {
    const int n = 12 + trial;
    accepted += CheckEpipolar(MakeScene(0, n, {}, false, 1.0, 100 + trial).pairs, trial).accepted;
  }
  EXPECT_LE(accepted, 1);
}

TEST(CheckEpipolar, AViewFromBehindIsRefused) {
  // The same lines of sight with every point behind camera b.
  Scene scene =
      MakeScene(40, 0, Rigid3(YawRotation(0.1), Eigen::Vector3d(0, -1.5, 0)), false, 0, 9);
  for (auto& [a, b] : scene.pairs) {
    b.direction = -b.direction;
  }
  const EpipolarModel truth{YawRotation(0.1), -Eigen::Vector3d::UnitY()};
  EXPECT_TRUE(std::isinf(truth.Residual(scene.pairs[0].first, scene.pairs[0].second)));
}

TEST(CheckEpipolar, TheSameSeedGivesTheSameBits) {
  const Rigid3 T_b_a(YawRotation(0.4), Eigen::Vector3d(0.5, -1.2, 0.2));
  const Scene scene = MakeScene(20, 60, T_b_a, false, 1.0, 11);
  const EpipolarResult first = CheckEpipolar(scene.pairs, 7);
  const EpipolarResult second = CheckEpipolar(scene.pairs, 7);
  EXPECT_EQ(first.inliers, second.inliers);
  EXPECT_EQ(first.model.t_b_a, second.model.t_b_a);
  EXPECT_EQ(first.log10_false_alarms, second.log10_false_alarms);
}

TEST(EpipolarModel, ResidualIsTheNoiseInSigmas) {
  const Rigid3 T_b_a(YawRotation(0.3), Eigen::Vector3d(0.3, -1.0, 0.3));
  const Scene scene = MakeScene(4000, 0, T_b_a, false, 1.0, 12);
  const EpipolarModel model{T_b_a.q, T_b_a.t.normalized()};
  double sum = 0;
  int count = 0;
  for (const auto& [a, b] : scene.pairs) {
    const double residual = model.Residual(a, b);
    if (std::isfinite(residual)) {
      sum += residual * residual;
      ++count;
    }
  }
  EXPECT_GT(count, 3900);
  EXPECT_NEAR(sum / count, 1.0, 0.08);  // chi-square of 4000 samples: 3.5 sigma
}

}  // namespace
}  // namespace pangea
