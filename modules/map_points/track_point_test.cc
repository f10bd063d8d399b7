#include "map_points/track_point.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <memory>
#include <random>

#include "core/testing/test_cameras.h"
#include "core/testing/test_record_store.h"

namespace pangea {
namespace {

using Eigen::Vector3d;

const MapId kMap{1, 100};

// `offsets`: of the pixel in each keyframe, one after the other along y, all looking along x.
std::optional<TrackPoint> PointSeenWith(const std::vector<Eigen::Vector2d>& offsets, double step_m,
                                        const Vector3d& p_map) {
  MapPoses poses;
  KeyframeStore store;
  for (int i = 0; i < static_cast<int>(offsets.size()); ++i) {
    Keyframe keyframe;
    keyframe.id = {kMap, i};
    keyframe.camera = EurocTestCamera();
    const Rigid3 T_map_body(ExpSo3({0.02 * i, -0.03 * i, 0.01}), {0.1 * i, step_m * i, 0.05 * i});
    const Vector3d p_cam = (T_map_body * keyframe.camera.T_body_cam).Inverse() * p_map;
    Corner corner;
    corner.pixel = (keyframe.camera.Project(p_cam).value() + offsets[i]).cast<float>();
    corner.landmark_id = 7;
    keyframe.corners = {corner};
    poses[keyframe.id] = T_map_body;
    store.Add(keyframe);
  }
  return PointOfTrack(poses, *store.Find({kMap, 0}), 0, &store);
}

// Three degrees of freedom: over many points the mean NEES is three.
TEST(TrackPoint, ErrorsAreWhatTheCovarianceSays) {
  std::mt19937_64 rng(5);
  std::normal_distribution<double> pixel(0, kTrackPointSigma_px);
  std::uniform_real_distribution<double> uniform(-1, 1);
  constexpr int kPoints = 400;
  double nees = 0;
  for (int n = 0; n < kPoints; ++n) {
    const Vector3d truth(6 + 2 * uniform(rng), 0.6 + uniform(rng), uniform(rng));
    std::vector<Eigen::Vector2d> noise(5);
    for (Eigen::Vector2d& offset : noise) {
      offset = {pixel(rng), pixel(rng)};
    }
    const auto point = PointSeenWith(noise, 0.3, truth);
    ASSERT_TRUE(point) << n;
    const Vector3d error = point->p_map - truth;
    nees += error.dot(point->covariance.ldlt().solve(error)) / kPoints;
  }
  EXPECT_NEAR(nees, 3, 0.4);  // three of its standard deviations
}

TEST(TrackPoint, SaysNothingWhenTheRaysDoNot) {
  const Vector3d p(6, 0.5, 0.2);
  const Eigen::Vector2d right(0, 0), wrong(40, -30);
  EXPECT_TRUE(PointSeenWith({right, right, right}, 0.3, p));
  EXPECT_FALSE(PointSeenWith({right, right}, 0.3, p));         // too few
  EXPECT_FALSE(PointSeenWith({right, right, right}, 0, p));    // all from one place
  EXPECT_FALSE(PointSeenWith({right, wrong, right}, 0.3, p));  // one of another point
}

// An agent that stands still sees the same landmark for hours.
TEST(TrackPoint, ReadsABoundedPartOfALongTrack) {
  constexpr int kKeyframes = 2000;
  const Vector3d p(3, 0.5, 0.2);
  MapPoses poses;
  const auto records = std::make_shared<test::TestRecordStore>(kKeyframes);
  KeyframeStore store({}, records);
  for (int i = 0; i < kKeyframes; ++i) {
    Keyframe keyframe;
    keyframe.id = {kMap, i};
    keyframe.camera = EurocTestCamera();
    const Rigid3 T_map_body(Eigen::Quaterniond::Identity(), {0, 0.01 * (i % 40), 0});
    Corner corner;
    corner.pixel = keyframe.camera.Project((T_map_body * keyframe.camera.T_body_cam).Inverse() * p)
                       .value()
                       .cast<float>();
    corner.landmark_id = 7;
    keyframe.corners = {corner};
    poses[keyframe.id] = T_map_body;
    store.Add(keyframe);
  }
  const auto point = PointOfTrack(poses, *store.Find({kMap, kKeyframes / 2}), 0, &store);
  ASSERT_TRUE(point);
  EXPECT_LT((point->p_map - p).norm(), 0.01);
  EXPECT_LT(records->num_read, 250);
}

}  // namespace
}  // namespace pangea
