#include "vio/keyframes/track_history.h"

#include <gtest/gtest.h>

#include <map>
#include <utility>
#include <vector>

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
      const FrameRay& seen = history.Frame(1).at(0).second;
      const MatrixXd numeric =
          pangea::NumericJacobian(kIntrinsicsSize, 1e-6, [&](const Intrinsics& intrinsics) {
            WindowState changed;
            changed.intrinsics = intrinsics;
            return changed.Calibrated(camera).Unproject(pixel).value();
          });
      EXPECT_LT((seen.J_intrinsics - numeric).cwiseAbs().maxCoeff(), 1e-6);
      // A change by half a per cent is still small, also in a distorted corner.
      WindowState state;
      state.intrinsics << 0.005, -0.0025, 0.0025, 0.002, -0.002;
      const Vector2d exact = state.Calibrated(camera).Unproject(pixel).value();
      EXPECT_LT((seen.RayBy(state) - exact).norm() * camera.fx, 0.1);
    }
  }
}

TEST(TrackHistory, TracksAreWhatFullTrackedFramesSaw) {
  const CameraModel camera = EurocTestCamera();
  TrackHistory history;
  WindowState state;
  for (const auto& [utime, ids] : std::map<int64_t, std::vector<int32_t>>{
           {1, {2}}, {2, {7, 2}}, {3, {2, 5}}, {4, {5, 7, 2}}}) {
    TrackedFrame frame{utime, {}};
    for (const int32_t id : ids) {
      frame.observations.push_back({id, {100, 100}, Vector2d(1e-3 * id, 1e-3 * utime)});
    }
    history.AddFrame(frame, camera, 1e-3);
    state.frames.emplace_back().utime = utime;
  }
  state.frames[0].pose_only = true;
  state.frames[2].is_tracked = false;
  const std::vector<TrackHistory::Track> tracks = history.Tracks(state);
  const std::vector<std::pair<int32_t, std::vector<int>>> kExpected = {
      {2, {1, 3}}, {5, {3}}, {7, {1, 3}}};
  ASSERT_EQ(tracks.size(), kExpected.size());
  for (size_t k = 0; k < tracks.size(); ++k) {
    const auto& [id, frames] = kExpected[k];
    EXPECT_EQ(tracks[k].landmark_id, id);
    ASSERT_EQ(tracks[k].rays.size(), frames.size());
    for (size_t j = 0; j < frames.size(); ++j) {
      EXPECT_EQ(tracks[k].rays[j].frame, frames[j]);
      EXPECT_EQ(tracks[k].rays[j].ray, Vector2d(1e-3 * id, 1e-3 * (frames[j] + 1)));
    }
  }
  EXPECT_EQ(history.Shared(2, 4), 2u);
  history.RemoveLandmark(7);
  EXPECT_FALSE(history.Sees(7));
  EXPECT_TRUE(history.Sees(5));
  EXPECT_EQ(history.Shared(2, 4), 1u);
}

}  // namespace
}  // namespace pangea::vio
