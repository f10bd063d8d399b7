#include "vio/keyframes/track_history.h"

#include <gtest/gtest.h>

#include "core/testing/numeric_jacobian.h"
#include "core/testing/test_cameras.h"

namespace pangea::vio {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;

TEST(TrackHistory, RaysFollowTheIntrinsics) {
  CameraModel fisheye = EurocTestCamera();
  fisheye.kind = CameraModel::Kind::kEquidistant;
  fisheye.distortion << -0.01, 0.02, -0.01, 0.002;
  for (const CameraModel& camera : {EurocTestCamera(), fisheye}) {
    for (const Vector2d& pixel : {Vector2d(10, 20), Vector2d(370, 250), Vector2d(700, 90)}) {
      TrackHistory history;
      history.AddFrame({1, {{5, pixel.cast<float>(), camera.Unproject(pixel).value()}}}, camera,
                       1e-3);
      const FrameRay& seen = history.Frame(1).at(5);
      const MatrixXd numeric = pangea::NumericJacobian(3, 1e-6, [&](const Vector3d& intrinsics) {
        WindowState changed;
        changed.intrinsics = intrinsics;
        return changed.Calibrated(camera).Unproject(pixel).value();
      });
      EXPECT_LT((seen.J_intrinsics - numeric).cwiseAbs().maxCoeff(), 1e-6);
      // Half a per cent is still small, also in a distorted corner.
      WindowState state;
      state.intrinsics = {0.005, -0.0025, 0.0025};
      const Vector2d exact = state.Calibrated(camera).Unproject(pixel).value();
      EXPECT_LT((seen.RayBy(state) - exact).norm() * camera.fx, 0.1);
    }
  }
}

}  // namespace
}  // namespace pangea::vio
