#include "core/camera_model.h"

#include <gtest/gtest.h>

#include <random>

#include "core/testing/numeric_jacobian.h"
#include "core/testing/test_cameras.h"

namespace pangea {
namespace {

CameraModel FisheyeCamera() {
  CameraModel camera = EurocTestCamera();
  camera.kind = CameraModel::Kind::kEquidistant;
  camera.fx = camera.fy = 310;
  camera.distortion << -0.0034, 0.0007, -0.0020, 0.0002;
  return camera;
}

class CameraModelTest : public ::testing::TestWithParam<CameraModel> {};

TEST_P(CameraModelTest, UnprojectInvertsProjectAllOverTheImage) {
  const CameraModel& camera = GetParam();
  for (int v = 0; v < camera.height; v += 16) {
    for (int u = 0; u < camera.width; u += 16) {
      const auto ray = camera.Unproject({u, v});
      ASSERT_TRUE(ray.has_value()) << u << ' ' << v;
      const auto pixel = camera.Project(Eigen::Vector3d(ray->x(), ray->y(), 1) * 3.7);
      ASSERT_TRUE(pixel.has_value());
      EXPECT_LT((*pixel - Eigen::Vector2d(u, v)).norm(), 1e-7);
    }
  }
}

TEST_P(CameraModelTest, JacobianMatchesCentralDifferences) {
  const CameraModel& camera = GetParam();
  std::mt19937 rng(3);
  std::uniform_real_distribution<double> u(20, 730), v(20, 460), depth(0.5, 20);
  for (int i = 0; i < 200; ++i) {
    const auto ray = camera.Unproject({u(rng), v(rng)});
    const Eigen::Vector3d p = Eigen::Vector3d(ray->x(), ray->y(), 1) * depth(rng);
    Eigen::Matrix<double, 2, 3> J;
    ASSERT_TRUE(camera.Project(p, &J).has_value());
    const Eigen::MatrixXd numeric = NumericJacobian(
        3, 1e-6, [&](const Eigen::Vector3d& d) { return camera.Project(p + d).value(); });
    EXPECT_LT((J - numeric).norm(), 1e-5 * (1 + J.norm()));
  }
}

TEST_P(CameraModelTest, DistortionJacobianMatchesCentralDifferences) {
  const CameraModel& camera = GetParam();
  for (const Eigen::Vector2d& pixel :
       {Eigen::Vector2d(30, 40), Eigen::Vector2d(380, 240), Eigen::Vector2d(700, 300)}) {
    const Eigen::Vector2d ray = camera.Unproject(pixel).value();
    const Eigen::MatrixXd numeric = NumericJacobian(2, 1e-6, [&](const Eigen::Vector2d& d) {
      CameraModel other = camera;
      other.distortion.head<2>() += d;
      return other.Project({ray.x(), ray.y(), 1}).value();
    });
    EXPECT_LT((camera.DistortionJacobian(ray) - numeric).norm(), 1e-5 * (1 + numeric.norm()));
  }
}

TEST_P(CameraModelTest, NothingBehindTheCamera) {
  EXPECT_FALSE(GetParam().Project({0.1, 0.1, -1}).has_value());
  EXPECT_FALSE(GetParam().Project({0.1, 0.1, 0}).has_value());
}

INSTANTIATE_TEST_SUITE_P(Models, CameraModelTest,
                         ::testing::Values(EurocTestCamera(), FisheyeCamera()));

// The radtan polynomial is not monotonic far outside the image; such points must not appear in it.
TEST(CameraModel, FoldedDistortionIsRefused) {
  CameraModel camera = EurocTestCamera();
  camera.distortion << -0.3, 0, 0, 0;  // turns back at r = 1.05
  EXPECT_FALSE(camera.Project({3.0, 0.0, 1.0}).has_value());
}

TEST(CameraModel, TheLastRowIsExposedTheReadoutAfterTheFirst) {
  CameraModel camera = EurocTestCamera();
  EXPECT_EQ(camera.RowTime_s(240), 0) << "a global shutter";
  camera.readout_s = 0.03;
  EXPECT_EQ(camera.RowTime_s(0), 0);
  EXPECT_DOUBLE_EQ(camera.RowTime_s(camera.height - 1), 0.03);
  EXPECT_DOUBLE_EQ(camera.RowTime_s(0.5 * (camera.height - 1)), 0.015);
}

TEST(CameraModel, SaysWhatIsWrong) {
  CameraModel camera = EurocTestCamera();
  EXPECT_FALSE(camera.Invalid().has_value());
  camera.fx = std::nan("");
  EXPECT_TRUE(camera.Invalid().has_value());
}

}  // namespace
}  // namespace pangea
