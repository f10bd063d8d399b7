#include "posegraph/solver/four_dof.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <random>

#include "core/testing/numeric_jacobian.h"
#include "posegraph/solver/pose_cost.h"

namespace pangea {
namespace {

using Random = std::mt19937_64;

double Normal(Random& random, double sigma) {
  return sigma * std::normal_distribution<double>(0, 1)(random);
}

Eigen::Vector3d NormalVector(Random& random, double sigma) {
  return {Normal(random, sigma), Normal(random, sigma), Normal(random, sigma)};
}

template <int N>
Eigen::Matrix<double, N, N> RandomCovariance(Random& random, double sigma) {
  Eigen::Matrix<double, N, N> A;
  for (double& value : A.reshaped()) {
    value = Normal(random, sigma);
  }
  return A * A.transpose() + 0.1 * sigma * sigma * Eigen::Matrix<double, N, N>::Identity();
}

Pose4 RandomPose(Random& random) { return {NormalVector(random, 5), Normal(random, 2)}; }

Eigen::Quaterniond RandomAttitude(Random& random) { return ExpSo3(NormalVector(random, 1.5)); }

TEST(PoseCost, JacobiansAgreeWithDifferences) {
  Random random(5);
  for (int trial = 0; trial < 200; ++trial) {
    Relative4 measured{NormalVector(random, 3), Normal(random, 1), {}};
    measured.covariance = RandomCovariance<4>(random, 0.3);
    const PoseCost cost(measured);
    const Pose4 from = RandomPose(random), to = RandomPose(random);
    const double log_scale = trial % 2 == 0 ? 0 : Normal(random, 0.3);
    PoseCost::Jacobians J;
    const Vector4d r = cost.Linearise(from, to, log_scale, &J);
    EXPECT_EQ(r, cost.Residual(from, to, log_scale));
    Eigen::Matrix<double, 4, 9> analytic;
    analytic << J.from, J.to, J.log_scale;
    const Eigen::MatrixXd numeric =
        NumericJacobian(9, 1e-6, [&](const Eigen::VectorXd& offset) -> Eigen::VectorXd {
          return cost.Residual({from.p + offset.head<3>(), from.yaw + offset[3]},
                               {to.p + offset.segment<3>(4), to.yaw + offset[7]},
                               log_scale + offset[8]);
        });
    EXPECT_LT((analytic - numeric).norm(), 1e-6 * (1 + numeric.norm())) << trial;
  }
}

// The residual of a relative pose between two tilted bodies, with their odometries' poses, is zero
// at the truth.
TEST(Residual, IsZeroAtTheTruth) {
  Random random(2);
  for (int trial = 0; trial < 100; ++trial) {
    const Rigid3 T_map_i(RandomAttitude(random), NormalVector(random, 5));
    const Rigid3 T_map_j(RandomAttitude(random), NormalVector(random, 5));
    const double yaw_i = Normal(random, 2), yaw_j = Normal(random, 2);
    const Relative4 relative = MakeRelative4(
        T_map_i.Inverse() * T_map_j, Matrix6d::Identity(), YawRotation(-yaw_i) * T_map_i.q,
        Eigen::Matrix2d::Zero(), YawRotation(-yaw_j) * T_map_j.q);
    EXPECT_LT(Residual({T_map_i.t, yaw_i}, {T_map_j.t, yaw_j}, relative).norm(), 1e-12);
  }
}

TEST(Whitening, OfACorrelatedCovarianceGivesTheMahalanobisDistance) {
  Random random(3);
  for (int trial = 0; trial < 50; ++trial) {
    const Matrix4d covariance = RandomCovariance<4>(random, 0.5);
    Vector4d r;
    r << NormalVector(random, 1), Normal(random, 1);
    EXPECT_NEAR((Whitening(covariance) * r).squaredNorm(), r.dot(covariance.inverse() * r),
                1e-4 * r.dot(covariance.inverse() * r));
  }
}

TEST(Whitening, SurvivesExtremes) {
  for (const double variance : {0.0, 1e-30, 1e12}) {
    const Matrix4d W = Whitening(variance * Matrix4d::Identity());
    EXPECT_TRUE(W.allFinite());
    EXPECT_GT(W.diagonal().minCoeff(), 0);
  }
}

// The 4x4 covariance predicts the scatter of measurements drawn from the 6x6 one, where rotation
// and translation are correlated and the body is tilted; in both directions.
TEST(MakeRelative4, CovarianceMatchesTheScatter) {
  Random random(4);
  const Rigid3 T_from_to(ExpSo3({0.2, -0.1, 0.5}), {1, -2, 0.4});
  const Matrix6d covariance = RandomCovariance<6>(random, 0.004);
  const Matrix6d L = covariance.llt().matrixL();
  const Eigen::Quaterniond q_odom_from = YawRotation(0.7) * ExpSo3({0.3, -0.2, 0});
  const Eigen::Quaterniond q_odom_to = YawRotation(-1.1) * q_odom_from * T_from_to.q;
  const Eigen::Matrix2d no_tilt = Eigen::Matrix2d::Zero();
  const Relative4 truth = MakeRelative4(T_from_to, covariance, q_odom_from, no_tilt, q_odom_to);
  const Relative4 inverse = truth.Inverse();
  double sum = 0, sum_inverse = 0;
  constexpr int kTrials = 5000;
  for (int trial = 0; trial < kTrials; ++trial) {
    Vector6d unit;
    unit << NormalVector(random, 1), NormalVector(random, 1);
    const Relative4 noisy =
        MakeRelative4(T_from_to.Plus(L * unit), covariance, q_odom_from, no_tilt, q_odom_to);
    const auto squared = [](const Relative4& a, const Relative4& b) {
      Vector4d error;
      error << a.t - b.t, WrapAngle(a.yaw - b.yaw);
      return error.dot(b.covariance.ldlt().solve(error));
    };
    sum += squared(noisy, truth);
    sum_inverse += squared(noisy.Inverse(), inverse);
  }
  EXPECT_NEAR(sum / kTrials, 4, 0.2);
  EXPECT_NEAR(sum_inverse / kTrials, 4, 0.2);
}

// The covariance from the first keyframe's tilt fits the scatter too: the step is measured in its
// body frame, so a wrong tilt displaces the other keyframe.
TEST(MakeRelative4, TheTiltOfTheFirstMovesTheStep) {
  Random random(5);
  const Rigid3 T_from_to(ExpSo3({0.2, -0.1, 0.5}), {1, -2, 0.4});
  const Matrix6d little = 1e-12 * Matrix6d::Identity();
  const Eigen::Quaterniond q_odom_from = YawRotation(0.7) * ExpSo3({0.3, -0.2, 0});
  const Eigen::Quaterniond q_odom_to = YawRotation(-1.1) * q_odom_from * T_from_to.q;
  Eigen::Matrix2d tilt;
  tilt << 4e-6, 1e-6, 1e-6, 2e-6;
  const Eigen::Matrix2d L = tilt.llt().matrixL();
  const Relative4 truth = MakeRelative4(T_from_to, little, q_odom_from, tilt, q_odom_to);
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  constexpr int kTrials = 5000;
  for (int trial = 0; trial < kTrials; ++trial) {
    const Eigen::Vector2d error = L * NormalVector(random, 1).head<2>();
    const Eigen::Quaterniond q_believed = ExpSo3({error.x(), error.y(), 0}) * q_odom_from;
    const Eigen::Vector3d moved =
        MakeRelative4(T_from_to, little, q_believed, tilt, q_odom_to).t - truth.t;
    scatter += moved * moved.transpose() / kTrials;
  }
  const Eigen::Matrix3d claimed = truth.covariance.topLeftCorner<3, 3>();
  EXPECT_LT((scatter - claimed).norm(), 0.1 * claimed.norm());
}

TEST(Pose4, ComposesLikeATransform) {
  Random random(5);
  const Pose4 a = RandomPose(random), b = RandomPose(random);
  const Eigen::Vector3d p = NormalVector(random, 3);
  EXPECT_LT(((a * b) * p - a * (b * p)).norm(), 1e-12);
  EXPECT_LT((a.Inverse() * (a * p) - p).norm(), 1e-12);
}

}  // namespace
}  // namespace pangea
