#include "loop_verification/extrinsics_error.h"

#include <gtest/gtest.h>

#include <random>

#include "core/testing/numeric_jacobian.h"
#include "core/testing/test_random.h"

namespace pangea {
namespace {

Matrix6d SmallCovariance(std::mt19937_64& rng) {
  std::normal_distribution<double> normal(0, 0.01);
  Matrix6d A;
  for (double& value : A.reshaped()) {
    value = normal(rng);
  }
  return A * A.transpose();
}

// The relative pose of the cameras is fixed; the extrinsics are perturbed in their left frames.
TEST(ExtrinsicsCovariance, IsThatOfTheBodiesWhileTheCamerasStay) {
  std::mt19937_64 rng(1);
  for (int trial = 0; trial < 20; ++trial) {
    Keyframe m, c;
    m.id.map = {1, 1};
    c.id.map = {trial % 2 == 0 ? 2 : 1, 2};
    m.camera.T_body_cam = RandomPose(rng, 1, 1);
    c.camera.T_body_cam = RandomPose(rng, 1, 1);
    m.T_body_cam_covariance = SmallCovariance(rng);
    c.T_body_cam_covariance = SmallCovariance(rng);
    const Rigid3 T_m_c = RandomPose(rng, 1, 1);
    const Rigid3 T_cam_cam = m.camera.T_body_cam.Inverse() * T_m_c * c.camera.T_body_cam;
    const Eigen::MatrixXd J = NumericJacobian(12, 1e-6, [&](const Eigen::VectorXd& offset) {
      const Rigid3 moved = m.camera.T_body_cam.Plus(offset.head<6>()) * T_cam_cam *
                           c.camera.T_body_cam.Plus(offset.tail<6>()).Inverse();
      return Eigen::VectorXd(moved.Minus(T_m_c));
    });
    Eigen::MatrixXd both = Eigen::MatrixXd::Zero(12, 12);
    both.topLeftCorner<6, 6>() = m.T_body_cam_covariance;
    both.bottomRightCorner<6, 6>() = c.T_body_cam_covariance;
    if (trial % 2 == 1) {  // one camera
      both.bottomRightCorner<6, 6>() = both.topRightCorner<6, 6>() = both.bottomLeftCorner<6, 6>() =
          m.T_body_cam_covariance;
    }
    const Matrix6d numeric = J * both * J.transpose();
    EXPECT_LT((ExtrinsicsCovariance(m, c, T_m_c) - numeric).norm(), 1e-5 * numeric.norm());
  }
}

}  // namespace
}  // namespace pangea
