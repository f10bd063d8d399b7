#include "core/rigid3.h"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "core/testing/numeric_jacobian.h"

namespace pangea {
namespace {

class Rigid3Test : public ::testing::Test {
 protected:
  Eigen::Vector3d RandomVector(double scale) {
    std::normal_distribution<double> normal(0, scale);
    return {normal(rng_), normal(rng_), normal(rng_)};
  }
  Rigid3 RandomRigid3() { return {ExpSo3(RandomVector(1.0)), RandomVector(3.0)}; }
  Matrix6d RandomCovariance() {
    Matrix6d A;
    std::normal_distribution<double> normal(0, 1);
    for (double& a : A.reshaped()) {
      a = normal(rng_);
    }
    return A * A.transpose() + 0.1 * Matrix6d::Identity();
  }
  std::mt19937 rng_{7};
};

TEST_F(Rigid3Test, GroupAxioms) {
  for (int i = 0; i < 100; ++i) {
    const Rigid3 A = RandomRigid3();
    const Rigid3 B = RandomRigid3();
    const Eigen::Vector3d p = RandomVector(2);
    EXPECT_LT(((A * B) * p - A * (B * p)).norm(), 1e-12);
    EXPECT_LT((A.Inverse() * A).Minus(Rigid3()).norm(), 1e-12);
    EXPECT_LT(A.Plus(B.Minus(A)).Minus(B).norm(), 1e-12);
  }
}

TEST_F(Rigid3Test, ExpAndLogInvertEachOtherAtEveryScale) {
  for (const double scale : {1e-12, 1e-9, 1e-5, 1e-2, 1.0}) {
    for (int i = 0; i < 50; ++i) {
      const Eigen::Vector3d w = RandomVector(scale);
      if (w.norm() < std::numbers::pi) {
        EXPECT_LT((LogSo3(ExpSo3(w)) - w).norm(), 1e-9 * scale + 1e-15);
      }
    }
  }
}

TEST_F(Rigid3Test, RightJacobianMatchesCentralDifferences) {
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector3d w = RandomVector(i < 10 ? 1e-5 : 0.8);
    const Eigen::Matrix3d numeric = NumericJacobian(3, 1e-6, [&](const Eigen::Vector3d& d) {
      return LogSo3(ExpSo3(w).conjugate() * ExpSo3(w + d));
    });
    EXPECT_LT((RightJacobian(w) - numeric).norm(), 1e-8);
    EXPECT_LT((RightJacobian(w) * RightJacobianInverse(w) - Eigen::Matrix3d::Identity()).norm(),
              1e-9);
  }
}

TEST_F(Rigid3Test, YawSurvivesItsOwnRotation) {
  for (double yaw = -3.1; yaw < 3.1; yaw += 0.1) {
    EXPECT_NEAR(YawOf(YawRotation(yaw)), yaw, 1e-12);
    EXPECT_NEAR(WrapAngle(yaw + 4 * std::numbers::pi), yaw, 1e-12);
  }
}

// Compares the first-order propagation with a numerical Jacobian.
TEST_F(Rigid3Test, CovarianceOfAProduct) {
  for (int i = 0; i < 20; ++i) {
    const Rigid3 A = RandomRigid3();
    const Rigid3 B = RandomRigid3();
    const Matrix6d cov_A = RandomCovariance();
    const Matrix6d cov_B = RandomCovariance();
    const auto numeric = [](const auto& f) -> Matrix6d {
      return NumericJacobian(6, 1e-6,
                             [&](const Vector6d& d) { return f(d).Minus(f(Vector6d::Zero())); });
    };
    const Matrix6d J_A = numeric([&](const Vector6d& d) { return A.Plus(d) * B; });
    const Matrix6d J_B = numeric([&](const Vector6d& d) { return A * B.Plus(d); });
    const Matrix6d product = J_A * cov_A * J_A.transpose() + J_B * cov_B * J_B.transpose();
    EXPECT_LT((ComposeCovariance(A, cov_A, B, cov_B) - product).norm(), 1e-6 * product.norm());
  }
}

TEST_F(Rigid3Test, CovarianceOfAnInverse) {
  for (int i = 0; i < 20; ++i) {
    const Rigid3 A = RandomRigid3();
    const Matrix6d covariance = RandomCovariance();
    const Matrix6d J = NumericJacobian(
        6, 1e-6, [&](const Vector6d& d) { return A.Plus(d).Inverse().Minus(A.Inverse()); });
    const Matrix6d expected = J * covariance * J.transpose();
    EXPECT_LT((InverseCovariance(A, covariance) - expected).norm(), 1e-6 * expected.norm());
  }
}

}  // namespace
}  // namespace pangea
