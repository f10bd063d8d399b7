#include "core/testing/synthetic_world.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

namespace pangea {
namespace {

TEST(SyntheticWorld, SameSeedSameWorldAnotherSeedAnother) {
  SyntheticWorldOptions options;
  options.num_keyframes = 5;
  const SyntheticWorld a = MakeSyntheticWorld(options), b = MakeSyntheticWorld(options);
  options.seed = 2;
  const SyntheticWorld c = MakeSyntheticWorld(options);
  EXPECT_EQ(a.agents[1].keyframes[4].T_odom_body.t, b.agents[1].keyframes[4].T_odom_body.t);
  EXPECT_EQ(a.agents[1].keyframes[4].corners[7].descriptor,
            b.agents[1].keyframes[4].corners[7].descriptor);
  EXPECT_NE(a.points[0].p_hall, c.points[0].p_hall);
}

TEST(SyntheticWorld, KeyframesAreComplete) {
  const SyntheticWorld world = MakeSyntheticWorld({});
  size_t corners = 0, points = 0;
  for (const SyntheticAgent& agent : world.agents) {
    ASSERT_EQ(agent.keyframes.size(), 60u);
    for (const Keyframe& keyframe : agent.keyframes) {
      corners += keyframe.corners.size();
      points += keyframe.points.size();
      EXPECT_LE(keyframe.corners.size(), static_cast<size_t>(kMaxCorners));
      EXPECT_EQ(keyframe.edge.has_value(), keyframe.id.seq > 0);
    }
  }
  EXPECT_GT(corners, 120 * 200u);
  EXPECT_GT(points, 120 * 40u);
}

// The true points lie where the keyframes observe them, within the stated variances.
TEST(SyntheticWorld, PointsAreAsNoisyAsTheyClaim) {
  const SyntheticWorld world = MakeSyntheticWorld({});
  double sum = 0;
  int count = 0;
  const SyntheticAgent& agent = world.agents[0];
  for (size_t k = 0; k < agent.keyframes.size(); ++k) {
    const Keyframe& keyframe = agent.keyframes[k];
    const Rigid3 T_cam_hall = (agent.T_hall_body[k] * keyframe.camera.T_body_cam).Inverse();
    for (const MapPoint& point : keyframe.points) {
      const SyntheticPoint& truth = world.points[agent.point_of_corner[k][point.corner]];
      const double error = point.inverse_depth - 1 / (T_cam_hall * truth.p_hall).z();
      sum += error * error / point.inverse_depth_var;
      ++count;
    }
  }
  EXPECT_NEAR(sum / count, 1, 0.1);
}

TEST(SyntheticWorld, EdgesDriftAsTheyClaim) {
  SyntheticWorldOptions options;
  options.with_corners = false;
  options.num_keyframes = 1000;
  options.tilt_sigma = 1e-6;
  const SyntheticWorld world = MakeSyntheticWorld(options);
  const SyntheticAgent& agent = world.agents[0];
  Eigen::Vector4d sum = Eigen::Vector4d::Zero();
  for (size_t k = 1; k < agent.keyframes.size(); ++k) {
    const OdometryEdge& edge = *agent.keyframes[k].edge;
    const Vector6d error =
        edge.T_from_this.Minus(agent.T_hall_body[k - 1].Inverse() * agent.T_hall_body[k]);
    sum.head<3>() += error.head<3>().cwiseAbs2();
    sum[3] += error.tail<3>().squaredNorm();
  }
  sum /= 999;
  EXPECT_NEAR(std::sqrt(sum.head<3>().mean()), options.edge_sigma_m, 3e-4);
  EXPECT_NEAR(std::sqrt(sum[3]), options.edge_sigma_yaw, 5e-5);
}

TEST(SyntheticWorld, TrueConstraintsAreAsNoisyAsTheyClaimAndFalseOnesAreNot) {
  SyntheticWorldOptions options;
  options.with_corners = false;
  const SyntheticWorld world = MakeSyntheticWorld(options);
  const std::vector<OverlappingPair> pairs = OverlappingPairs(world, 2.0, 20);
  ASSERT_GT(pairs.size(), 100u);
  std::mt19937_64 random(3);
  double sum = 0, least_false = 1e9;
  for (const auto& [from, to] : pairs) {
    const Rigid3 truth = world.T_hall_body(from).Inverse() * world.T_hall_body(to);
    const auto squared = [&](const Constraint& constraint) {
      const Vector6d error = constraint.T_from_to.Minus(truth);
      return error.dot(constraint.covariance.ldlt().solve(error));
    };
    sum += squared(MakeTrueConstraint(world, from, to, {}, random));
    least_false = std::min(least_false, squared(MakeFalseConstraint(world, from, to, {}, random)));
  }
  EXPECT_NEAR(sum / static_cast<double>(pairs.size()), 6, 0.8);
  EXPECT_GT(least_false, 1000);
}

}  // namespace
}  // namespace pangea
