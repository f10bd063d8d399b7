#include "loop_verification/upright_pnp.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <random>

#include "core/testing/test_random.h"

namespace pangea {
namespace {

using Random = std::mt19937_64;

Rigid3 RandomUpright(Random& random) {
  return {YawRotation(Uniform(random, -3, 3)),
          {Uniform(random, -2, 2), Uniform(random, -2, 2), Uniform(random, -1, 1)}};
}

// One of the solutions is the truth, to rounding.
TEST(UprightPnp, TwoPointsAreExact) {
  Random random(1);
  for (int run = 0; run < 1000; ++run) {
    const Rigid3 T_w_g = RandomUpright(random);
    const auto point = [&random] {
      return Eigen::Vector3d(Uniform(random, -3, 3), Uniform(random, 2, 8), Uniform(random, -2, 2));
    };
    const Eigen::Vector3d p1_g = point(), p2_g = point();
    const auto poses = SolveUprightTwoPoint(T_w_g * p1_g, T_w_g * p2_g, 0.7 * p1_g, 1.3 * p2_g);
    ASSERT_FALSE(poses.empty());
    double nearest = 1e9;
    for (const Rigid3& pose : poses) {
      nearest = std::min(nearest, pose.Minus(T_w_g).norm());
    }
    // Level rays are nearly degenerate: the constant is generous for those.
    EXPECT_LT(nearest, 1e-5);
  }
}

struct Scene {
  Rigid3 T_m_c;
  std::vector<PointObservation> observations;
};

// Points of m in front of a camera of c, and the reverse; the first `wrong` of each direction are
// displaced.
Scene MakeScene(int count, int wrong, const Eigen::Vector2d& tilt, Random& random) {
  Scene scene;
  scene.T_m_c = RandomUpright(random);
  scene.T_m_c.q = ExpSo3({tilt.x(), tilt.y(), 0}) * scene.T_m_c.q;
  for (const Direction direction : {Direction::kForward, Direction::kReverse}) {
    Rigid3 T_w_cam(ExpSo3({Uniform(random, -2, 2), Uniform(random, -2, 2), 0.4}), {0.1, 0, 0.05});
    for (int i = 0; i < count; ++i) {
      PointObservation observation;
      observation.direction = direction;
      observation.T_cam_w = T_w_cam.Inverse();
      observation.R_cam_w = observation.T_cam_w.R();
      const Eigen::Vector3d p_cam(Uniform(random, -2, 2), Uniform(random, -1.5, 1.5),
                                  Uniform(random, 3, 7));
      const Rigid3 T_holder_observer =
          direction == Direction::kForward ? scene.T_m_c : scene.T_m_c.Inverse();
      observation.p_w = T_holder_observer * (T_w_cam * p_cam);
      observation.depth_sigma_w = 0.02 * (T_holder_observer.q * (T_w_cam.q * p_cam));
      observation.p_w += std::normal_distribution<double>(0, 1)(random) * observation.depth_sigma_w;
      observation.ray = p_cam.head<2>() / p_cam.z();
      if (i < wrong) {
        observation.ray = {Uniform(random, -0.7, 0.7), Uniform(random, -0.5, 0.5)};
      }
      observation.sqrt_info = 450 * Eigen::Matrix2d::Identity();
      for (int axis = 0; axis < 2; ++axis) {
        observation.ray[axis] += std::normal_distribution<double>(0, 1)(random) / 450;
      }
      scene.observations.push_back(observation);
    }
  }
  return scene;
}

TEST(UprightPnp, FindsThePoseAmongTwoThirdsOfOutliers) {
  Random random(2);
  for (int run = 0; run < 20; ++run) {
    const Scene scene = MakeScene(30, 20, {0.002, 0}, random);
    const auto result =
        SolveUprightPnp(scene.observations, {}, {0.1, 0, 0.05}, {0.1, 0, 0.05}, 0.01, 7);
    ASSERT_TRUE(result);
    const Vector6d error = result->pose.T_m_c.Minus(scene.T_m_c);
    EXPECT_LT(error.head<3>().norm(), 0.2);
    EXPECT_LT(error.tail<3>().norm(), 0.03);
    EXPECT_GE(result->inliers.size(), 17u);
    EXPECT_LE(result->inliers.size(), 23u);
  }
}

TEST(UprightPnp, SameSeedSamePose) {
  Random random(3);
  const Scene scene = MakeScene(20, 10, {0, 0}, random);
  const auto solve = [&scene] {
    return SolveUprightPnp(scene.observations, {}, {0, 0, 0}, {0, 0, 0}, 0.01, 11);
  };
  const auto first = solve(), second = solve();
  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->pose.T_m_c.t, second->pose.T_m_c.t);
  EXPECT_EQ(first->inliers, second->inliers);
}

// The refinement's covariance is honest (6 degrees of freedom; the tilt prior is drawn too).
// Cauchy's weights, on average 0.84 at the truth, make it too large by that factor, which only
// widens the search.
TEST(UprightPnp, RefinedPoseIsConsistent) {
  Random random(4);
  double nees = 0;
  constexpr int kRuns = 200;
  constexpr double kTilt = 0.005;
  std::normal_distribution<double> tilt(0, kTilt);
  for (int run = 0; run < kRuns; ++run) {
    const double roll = tilt(random), pitch = tilt(random);
    const Scene scene = MakeScene(25, 0, {roll, pitch}, random);
    const PoseEstimate estimate = RefinePose(scene.observations, scene.T_m_c, kTilt);
    const Vector6d error = estimate.T_m_c.Minus(scene.T_m_c);
    nees += error.dot(estimate.covariance.inverse() * error) / kRuns;
  }
  EXPECT_NEAR(nees, 0.84 * 6, 0.75);  // three standard deviations of the mean
}

// Chi-squared with the full covariance of pixel, tilt and depth, without the closed form.
TEST(PointObservation, Chi2IsTheMahalanobisDistance) {
  Random random(5);
  const Scene scene = MakeScene(20, 5, {0.002, 0.001}, random);
  for (const PointObservation& observation : scene.observations) {
    const auto residual = Residual(observation, scene.T_m_c);
    ASSERT_TRUE(residual);
    for (const double extra_var : {0.0, 2.5}) {
      const Eigen::Matrix2d covariance = (1 + extra_var) * Eigen::Matrix2d::Identity() +
                                         residual->depth_sigma * residual->depth_sigma.transpose();
      const double expected = residual->r.dot(covariance.inverse() * residual->r);
      EXPECT_NEAR(Chi2(observation, scene.T_m_c, extra_var), expected, 1e-9 * (1 + expected));
    }
  }
}

// More points agree with a wrong pose than with the right one; the matches without a depth decide.
TEST(UprightPnp, RaysWithoutADepthVote) {
  Random random(6);
  for (int run = 0; run < 10; ++run) {
    Scene scene = MakeScene(4, 0, {0, 0}, random);
    const Scene wrong = MakeScene(6, 0, {0, 0}, random);
    scene.observations.insert(scene.observations.end(), wrong.observations.begin(),
                              wrong.observations.end());
    const Eigen::Vector3d origin_c(0.1, 0, 0.05), origin_m(0.2, -0.1, 0);
    std::vector<RayPair> pairs;
    for (int i = 0; i < 30; ++i) {
      const Eigen::Vector3d p_m(Uniform(random, -4, 4), Uniform(random, 3, 7),
                                Uniform(random, -2, 2));
      pairs.push_back({(p_m - origin_m).normalized(),
                       (scene.T_m_c.Inverse() * p_m - origin_c).normalized(), 0.003});
    }
    const auto error = [&](const std::vector<RayPair>& votes) {
      const auto result = SolveUprightPnp(scene.observations, votes, origin_c, origin_m, 0.005, 7);
      return result ? result->pose.T_m_c.Minus(scene.T_m_c).norm() : 1e9;
    };
    EXPECT_GT(error({}), 0.3);
    EXPECT_LT(error(pairs), 0.3);
  }
}

}  // namespace
}  // namespace pangea
