#include "loop_verification/joint_ba/ba_factors.h"

#include <gtest/gtest.h>

#include <array>
#include <random>
#include <vector>

#include "core/testing/numeric_jacobian.h"
#include "loop_verification/correspondences/point_observation.h"

namespace pangea {
namespace {

using Random = std::mt19937_64;

double Uniform(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

Eigen::Vector3d RandomVector(Random& random, double size) {
  return {Uniform(random, -size, size), Uniform(random, -size, size), Uniform(random, -size, size)};
}

Rigid3 RandomPose(Random& random, double angle, double distance) {
  return {ExpSo3(RandomVector(random, angle)), RandomVector(random, distance)};
}

Matrix6d RandomCovariance(Random& random) {
  Matrix6d A;
  for (int i = 0; i < 36; ++i) {
    A(i) = Uniform(random, -1, 1);
  }
  return 1e-2 * (A * A.transpose() + 0.1 * Matrix6d::Identity());
}

// Compares the analytic Jacobian in the tangent with central differences.
void ExpectJacobian(const ceres::CostFunction& factor, std::vector<std::vector<double>> blocks) {
  const RigidManifold rigid;
  std::vector<double*> pointers;
  for (auto& block : blocks) {
    pointers.push_back(block.data());
  }
  // RigidManifold's PlusJacobian is not the ambient derivative (it pairs with the factors'
  // Jacobians by the tangent), so differences are taken in the tangent here.
  Eigen::VectorXd residual(factor.num_residuals());
  std::vector<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> jacobians;
  std::vector<double*> jacobian_pointers;
  for (const auto& block : blocks) {
    jacobians.emplace_back(factor.num_residuals(), static_cast<int>(block.size()));
  }
  for (auto& jacobian : jacobians) {
    jacobian_pointers.push_back(jacobian.data());
  }
  ASSERT_TRUE(factor.Evaluate(pointers.data(), residual.data(), jacobian_pointers.data()));
  for (size_t b = 0; b < blocks.size(); ++b) {
    const int size = blocks[b].size() == 7 ? 6 : static_cast<int>(blocks[b].size());
    const std::vector<double> at = blocks[b];
    for (int i = 0; i < size; ++i) {
      constexpr double kStep = 1e-5;
      std::array<Eigen::VectorXd, 2> sides;
      for (const int side : {0, 1}) {
        const double step = side == 0 ? -kStep : kStep;
        if (size == 6) {
          Vector6d delta = Vector6d::Zero();
          delta[i] = step;
          rigid.Plus(at.data(), delta.data(), blocks[b].data());
        } else {
          blocks[b] = at;
          blocks[b][i] += step;
        }
        sides[side].resize(factor.num_residuals());
        ASSERT_TRUE(factor.Evaluate(pointers.data(), sides[side].data(), nullptr));
        blocks[b] = at;
      }
      const Eigen::VectorXd numeric = (sides[1] - sides[0]) / (2 * kStep);
      // Central differences: truncation 1e-10 times third derivatives, rounding 1e-11 of the value.
      const double scale = 1 + numeric.norm() + residual.norm();
      EXPECT_LT((numeric - jacobians[b].col(i)).norm() / scale, 1e-6) << "block " << b << " " << i;
    }
    if (size == 6) {
      EXPECT_EQ(jacobians[b].col(6).norm(), 0);
    }
  }
}

std::vector<double> ToBlock(const Rigid3& pose) {
  std::vector<double> block(7);
  PoseToBlock(pose, block.data());
  return block;
}

TEST(BaFactors, ReprojectionJacobian) {
  Random random(1);
  for (int run = 0; run < 100; ++run) {
    const Rigid3 T_body_cam = RandomPose(random, 2, 0.2), T_host = RandomPose(random, 2, 5);
    const Rigid3 T_target = T_host * RandomPose(random, 0.3, 0.5);
    Eigen::Matrix2d sqrt_info;
    sqrt_info << 400, 20, -10, 380;
    const ReprojectionFactor factor(T_body_cam, T_body_cam, {0.1, -0.2}, sqrt_info);
    ExpectJacobian(factor, {ToBlock(T_host),
                            ToBlock(T_target),
                            {Uniform(random, -0.3, 0.3), Uniform(random, -0.3, 0.3),
                             Uniform(random, 0.1, 0.4)}});
  }
}

TEST(BaFactors, ReprojectionIsZeroAtTheTruth) {
  Random random(2);
  for (int run = 0; run < 20; ++run) {
    const Rigid3 T_body_cam = RandomPose(random, 2, 0.2), T_host = RandomPose(random, 2, 5);
    const Rigid3 T_target = T_host * RandomPose(random, 0.2, 0.3);
    const Eigen::Vector3d p_host(0.3, -0.2, 3.0);
    const Eigen::Vector3d p = (T_target * T_body_cam).Inverse() * (T_host * T_body_cam * p_host);
    const ReprojectionFactor factor(T_body_cam, T_body_cam, p.head<2>() / p.z(),
                                    450 * Eigen::Matrix2d::Identity());
    const auto host = ToBlock(T_host), target = ToBlock(T_target);
    const std::vector<double> point = {0.1, -0.2 / 3, 1.0 / 3};
    const double* blocks[] = {host.data(), target.data(), point.data()};
    Eigen::Vector2d residual;
    ASSERT_TRUE(factor.Evaluate(blocks, residual.data(), nullptr));
    EXPECT_LT(residual.norm(), 1e-9);
  }
}

TEST(BaFactors, ReprojectionRefusesAPointBehindTheCamera) {
  const ReprojectionFactor factor({}, {}, {0, 0}, Eigen::Matrix2d::Identity());
  const auto host = ToBlock({}), target = ToBlock({Eigen::Quaterniond::Identity(), {0, 0, 5}});
  const std::vector<double> point = {0, 0, 0.5};
  const double* blocks[] = {host.data(), target.data(), point.data()};
  Eigen::Vector2d residual;
  EXPECT_FALSE(factor.Evaluate(blocks, residual.data(), nullptr));
}

TEST(BaFactors, PointPriorJacobian) {
  Eigen::Matrix2d sqrt_info;
  sqrt_info << 400, 20, -10, 380;
  const PointPriorFactor factor({0.1, 0.2}, sqrt_info, 0.3, 0.02);
  ExpectJacobian(factor, {{0.11, 0.19, 0.28}, {0.03}});
}

TEST(BaFactors, EdgeJacobianWithACorrelatedCovariance) {
  Random random(3);
  for (int run = 0; run < 100; ++run) {
    const Rigid3 T_from = RandomPose(random, 2, 5), T_from_to = RandomPose(random, 0.5, 1);
    const Rigid3 T_to = T_from * T_from_to * RandomPose(random, 0.1, 0.1);
    for (const auto metres : {EdgeFactor::Metres::kWorld, EdgeFactor::Metres::kOdometry}) {
      ExpectJacobian(EdgeFactor(T_from_to, RandomCovariance(random), metres),
                     {ToBlock(T_from), ToBlock(T_to), {Uniform(random, -0.3, 0.3)}});
    }
  }
}

// The whitened residual squared is the Mahalanobis distance of the convention's error.
TEST(BaFactors, EdgeIsWhitenedByItsCovariance) {
  Random random(4);
  const Rigid3 T_from = RandomPose(random, 2, 5), T_from_to = RandomPose(random, 0.5, 1);
  const Matrix6d covariance = RandomCovariance(random);
  Vector6d xi;
  xi << 0.1, -0.2, 0.05, 0.01, 0.03, -0.02;
  const auto from = ToBlock(T_from), to = ToBlock(T_from * T_from_to.Plus(xi));
  const double scale = 0;
  const double* blocks[] = {from.data(), to.data(), &scale};
  Vector6d residual;
  ASSERT_TRUE(EdgeFactor(T_from_to, covariance).Evaluate(blocks, residual.data(), nullptr));
  EXPECT_NEAR(residual.squaredNorm(), xi.dot(covariance.inverse() * xi), 1e-6);
}

TEST(BaFactors, ScalePriorJacobian) { ExpectJacobian(ScalePriorFactor(0.01), {{0.02}}); }

TEST(PointObservation, JacobianOfBothDirections) {
  Random random(5);
  for (int run = 0; run < 100; ++run) {
    PointObservation observation;
    observation.direction = run % 2 == 0 ? Direction::kForward : Direction::kReverse;
    observation.T_cam_w = RandomPose(random, 2, 1);
    observation.ray = {0.1, 0.1};
    observation.sqrt_info << 400, 20, -10, 380;
    const Rigid3 T_m_c = RandomPose(random, 2, 1);
    const Rigid3 T_observer_holder =
        observation.direction == Direction::kForward ? T_m_c.Inverse() : T_m_c;
    const Eigen::Vector3d p_cam(Uniform(random, -1, 1), Uniform(random, -1, 1), 4);
    observation.p_w = T_observer_holder.Inverse() * (observation.T_cam_w.Inverse() * p_cam);
    observation.depth_sigma_w = RandomVector(random, 0.1);
    Eigen::Matrix<double, 2, 6> J;
    const auto at = Residual(observation, T_m_c, &J);
    ASSERT_TRUE(at);
    const Eigen::MatrixXd numeric = NumericJacobian(6, 1e-5, [&](const Vector6d& xi) {
      return Residual(observation, T_m_c.Plus(xi)).value().r;
    });
    for (int i = 0; i < 6; ++i) {
      EXPECT_LT((numeric - J).col(i).norm() / (1 + numeric.col(i).norm()), 1e-5);
    }
    // One sigma of depth moves the residual by depth_sigma.
    PointObservation moved = observation;
    moved.p_w += 1e-5 * observation.depth_sigma_w;
    EXPECT_LT(((Residual(moved, T_m_c)->r - at->r) / 1e-5 - at->depth_sigma).norm(),
              1e-2 * (1 + at->depth_sigma.norm()));
  }
}

}  // namespace
}  // namespace pangea
