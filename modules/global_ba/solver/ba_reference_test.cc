#include "global_ba/solver/ba_reference.h"

#include <gtest/gtest.h>

#include <random>

#include "core/testing/numeric_jacobian.h"
#include "core/testing/test_random.h"
#include "global_ba/ba_factors.h"

namespace pangea {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

TEST(LandmarkFactor, DerivativesMatchDifferences) {
  std::mt19937_64 rng(1);
  for (int trial = 0; trial < 20; ++trial) {
    const Rigid3 T_map_body = RandomPose(rng, 1, 3), T_body_cam = RandomPose(rng, 1, 3);
    const Vector3d p_cam(0.4, -0.3, 2.5 + 0.1 * trial);
    const Vector3d point = T_map_body * (T_body_cam * p_cam);
    Eigen::Matrix2d sqrt_info;
    sqrt_info << 100, 20, -5, 80;
    const LandmarkFactor factor({0.1, 0.1}, sqrt_info);
    double pose[7], landmark[3], camera[7];
    const auto evaluate = [&](const VectorXd& offset, double** jacobians) {
      PoseToBlock(T_map_body.Plus(offset.head<6>()), pose);
      Vector3d::Map(landmark) = point + offset.segment<3>(6);
      PoseToBlock(T_body_cam.Plus(offset.tail<6>()), camera);
      const double* const blocks[] = {pose, landmark, camera};
      VectorXd r(2);
      EXPECT_TRUE(factor.Evaluate(blocks, r.data(), jacobians));
      return r;
    };
    Eigen::Matrix<double, 2, 7, Eigen::RowMajor> J_pose, J_camera;
    Eigen::Matrix<double, 2, 3, Eigen::RowMajor> J_landmark;
    double* jacobians[] = {J_pose.data(), J_landmark.data(), J_camera.data()};
    const VectorXd r = evaluate(VectorXd::Zero(15), jacobians);
    EXPECT_LT((r - sqrt_info * (p_cam.hnormalized() - Eigen::Vector2d(0.1, 0.1))).norm(), 1e-9);
    MatrixXd J(2, 15);
    J << J_pose.leftCols<6>(), J_landmark, J_camera.leftCols<6>();
    const MatrixXd numeric = NumericJacobian(
        15, 1e-6, [&](const VectorXd& offset) -> VectorXd { return evaluate(offset, nullptr); });
    EXPECT_LT((J - numeric).cwiseAbs().maxCoeff(), 1e-6 * numeric.cwiseAbs().maxCoeff());
  }
}

TEST(LandmarkFactor, BehindTheCameraItIsAnOutlierWithoutSlope) {
  const LandmarkFactor factor({0, 0}, Eigen::Matrix2d::Identity());
  const double pose[] = {0, 0, 0, 1, 0, 0, 0}, landmark[] = {0.1, 0.2, -1};
  const double* const blocks[] = {pose, landmark, pose};
  Eigen::Vector2d r;
  Eigen::Matrix<double, 2, 7, Eigen::RowMajor> J_pose, J_camera;
  Eigen::Matrix<double, 2, 3, Eigen::RowMajor> J_landmark;
  double* jacobians[] = {J_pose.data(), J_landmark.data(), J_camera.data()};
  EXPECT_TRUE(factor.Evaluate(blocks, r.data(), jacobians));
  EXPECT_GT(r.squaredNorm(), BaOptions{}.max_chi2);
  EXPECT_EQ(J_pose.norm() + J_landmark.norm() + J_camera.norm(), 0);
}

}  // namespace
}  // namespace pangea
