#include "anchors/surface.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include <cmath>
#include <numbers>
#include <random>

namespace pangea {
namespace {

// Points of the plane n.p = distance, seen with noise that is relative to the depth.
std::vector<SurfacePoint> PlanePoints(const Eigen::Vector3d& n, double distance, int count,
                                      double relative_sigma, uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> offset(-0.2, 0.2);
  std::normal_distribution<double> noise;
  std::vector<SurfacePoint> points;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector2d ray(offset(random), offset(random));
    const double inverse_depth = n.dot(ray.homogeneous()) / distance;
    const double sigma = relative_sigma * inverse_depth;
    points.push_back({ray, inverse_depth + sigma * noise(random), sigma});
  }
  return points;
}

TEST(Surface, ASlantedPlaneIsFoundExactly) {
  const Eigen::Vector3d n = Eigen::Vector3d(0.5, 0.2, 1).normalized();
  const auto depth = DepthBehind({0.05, -0.03}, PlanePoints(n, 3, 60, 1e-4, 1));
  ASSERT_TRUE(depth);
  const double truth = 3 / n.dot(Eigen::Vector3d(0.05, -0.03, 1));
  EXPECT_NEAR(depth->depth_m, truth, 0.02 * truth);
}

// Errors are below the stated sigma: the surface is exactly plane here.
TEST(Surface, ItsSigmaIsNotTooSmall) {
  const Eigen::Vector3d n(0, 0, 1);
  double squares = 0;
  constexpr int kTrials = 200;
  for (int i = 0; i < kTrials; ++i) {
    const auto depth = DepthBehind({0, 0}, PlanePoints(n, 4, 20, 0.03, 100 + i));
    ASSERT_TRUE(depth);
    squares += std::pow((depth->depth_m - 4) / depth->sigma_m, 2);
  }
  EXPECT_LT(squares / kTrials, 1.2);
  EXPECT_GT(squares / kTrials, 0.1);
}

// Boxes stand before a wall: what lies between two points is not known, and the sigma must say so.
TEST(Surface, ItsSigmaCountsSteps) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> place(-0.2, 0.2), yaw(0, 2 * std::numbers::pi);
  int placed = 0, beyond = 0;
  for (int i = 0; i < 300; ++i) {
    const double edge = place(random), angle = yaw(random);
    const Eigen::Vector2d across(std::cos(angle), std::sin(angle));
    auto points = PlanePoints({0, 0, 1}, 4, 40, 0.01, 1000 + i);
    for (SurfacePoint& point : points) {
      point.inverse_depth *= across.dot(point.ray) > edge ? 1.3 : 1;
    }
    if (const auto depth = DepthBehind({0, 0}, points)) {
      ++placed;
      const double truth = edge < 0 ? 4 / 1.3 : 4;
      beyond += static_cast<int>(std::abs(depth->depth_m - truth) > 3 * depth->sigma_m);
    }
  }
  EXPECT_GT(placed, 280);
  EXPECT_LT(beyond, 0.05 * placed);
}

TEST(Surface, AFewWrongPointsDoNotMoveIt) {
  auto points = PlanePoints({0, 0, 1}, 2, 12, 0.01, 3);
  for (SurfacePoint& point : points) {
    point.ray *= 0.3;  // all of them close by
  }
  points[2].inverse_depth *= 3;
  points[7].inverse_depth /= 4;
  const auto depth = DepthBehind({0, 0}, points);
  ASSERT_TRUE(depth);
  EXPECT_NEAR(depth->depth_m, 2, 0.06);
}

TEST(Surface, TooFewPointsOrFarOnesAreNone) {
  EXPECT_FALSE(DepthBehind({0, 0}, {}));
  EXPECT_FALSE(DepthBehind({0, 0}, PlanePoints({0, 0, 1}, 2, 2, 0.01, 4)));
  EXPECT_FALSE(DepthBehind({0.6, 0}, PlanePoints({0, 0, 1}, 2, 30, 0.01, 5)));
}

TEST(Surface, PointsThatContradictEachOtherAreNone) {
  std::vector<SurfacePoint> points;
  for (int i = 0; i < 6; ++i) {
    const double angle = i;
    points.push_back(
        {{0.1 * std::cos(angle), 0.1 * std::sin(angle)}, i % 2 == 0 ? 0.2 : 1.0, 0.005});
  }
  EXPECT_FALSE(DepthBehind({0, 0}, points));
}

}  // namespace
}  // namespace pangea
