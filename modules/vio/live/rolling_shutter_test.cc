#include "vio/live/rolling_shutter.h"

#include <gtest/gtest.h>

#include <random>

#include "core/testing/test_cameras.h"

namespace pangea::vio {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

CameraModel Phone(double readout_s) {
  CameraModel camera = PinholeTestCamera(640, 480, 450);
  camera.distortion << -0.05, 0.01, 0, 0;
  camera.T_body_cam = {ExpSo3({0.3, -1.2, 0.4}), {0.05, -0.02, 0.01}};
  camera.readout_s = readout_s;
  return camera;
}

// Pixel and time at which a row of a moving camera sees a point that is given in the camera frame
// of the image's time.
std::optional<Vector2d> SeenByRow(const CameraModel& camera, const BodyMotion& motion,
                                  const Vector3d& p_cam) {
  Vector2d pixel(camera.cx, camera.cy);
  for (int i = 0; i < 20; ++i) {
    const double s = camera.readout_s * pixel.y() / (camera.height - 1);
    const Vector3d p_row =
        (motion.After(s) * camera.T_body_cam).Inverse() * (camera.T_body_cam * p_cam);
    const auto next = camera.Project(p_row);
    if (!next) {
      return std::nullopt;
    }
    pixel = *next;
  }
  return pixel;
}

TEST(RollingShutter, WhatRowsSawLandsWhereTheFirstRowWouldHaveSeenIt) {
  const CameraModel camera = Phone(0.03);
  const BodyMotion motion{{0.4, -0.9, 0.6}, {15, 5, -20}, {0.8, -0.3, 0.5}, {2, 1, -3}};
  std::mt19937_64 rng(3);
  std::uniform_real_distribution<double> uniform(-1, 1);
  Keyframe keyframe;
  keyframe.camera = camera;
  std::vector<Vector2d> expected;
  std::vector<double> depth;
  double shift = 0;
  while (expected.size() < 60) {
    const bool far = expected.size() % 2 == 1;
    const double z = far ? 1e6 : 3 + 2 * uniform(rng);
    const Vector3d p_cam(0.45 * uniform(rng) * z, 0.35 * uniform(rng) * z, z);
    const auto still = camera.Project(p_cam);
    const auto seen = SeenByRow(camera, motion, p_cam);
    if (!still || !seen || !camera.Contains(*still, 2) || !camera.Contains(*seen, 2)) {
      continue;
    }
    // The depth is that from the row's camera.
    const double s = camera.readout_s * seen->y() / (camera.height - 1);
    const Vector3d p_row =
        (motion.After(s) * camera.T_body_cam).Inverse() * (camera.T_body_cam * p_cam);
    keyframe.points.push_back(
        {static_cast<int>(expected.size()), static_cast<float>(1 / p_row.z()), 1e-4F});
    depth.push_back(z);
    keyframe.corners.emplace_back().pixel = seen->cast<float>();
    expected.push_back(*still);
    shift = std::max(shift, (*still - *seen).norm());
  }
  CompensateRollingShutter(motion, keyframe);
  ASSERT_GT(shift, 5);  // the correction has something to remove
  for (size_t i = 0; i < expected.size(); ++i) {
    EXPECT_LT((keyframe.corners[i].pixel.cast<double>() - expected[i]).norm(), 0.01) << i;
  }
  for (size_t i = 0; i < depth.size(); ++i) {
    EXPECT_NEAR(static_cast<double>(keyframe.points[i].inverse_depth), 1 / depth[i], 1e-5);
  }
}

// A corner without depth uses the depth of the map points around it.
TEST(RollingShutter, CornersWithoutDepthMoveAsTheirNeighboursDo) {
  const BodyMotion motion{Vector3d::Zero(), Vector3d::Zero(), {0.8, -0.3, 0.5}, Vector3d::Zero()};
  Keyframe keyframe;
  keyframe.camera = Phone(0.03);
  for (int i = 0; i < 3; ++i) {  // near on the left, far on the right
    keyframe.corners.emplace_back().pixel = Eigen::Vector2f(100, 400);
    keyframe.points.push_back({2 * i, 1 / 2.0F, 1e-4F});
    keyframe.corners.emplace_back().pixel = Eigen::Vector2f(540, 400);
    keyframe.points.push_back({2 * i + 1, 1 / 20.0F, 1e-4F});
  }
  keyframe.corners.emplace_back().pixel = Eigen::Vector2f(100, 400);
  keyframe.corners.emplace_back().pixel = Eigen::Vector2f(540, 400);
  CompensateRollingShutter(motion, keyframe);
  EXPECT_GT((keyframe.corners[0].pixel - Eigen::Vector2f(100, 400)).norm(), 2);
  EXPECT_LT((keyframe.corners[6].pixel - keyframe.corners[0].pixel).norm(), 1e-3);
  EXPECT_LT((keyframe.corners[7].pixel - keyframe.corners[1].pixel).norm(), 1e-3);
}

TEST(RollingShutter, AGlobalShutterIsLeftAlone) {
  Keyframe keyframe;
  keyframe.camera = Phone(0);
  keyframe.corners.emplace_back().pixel = {100, 200};
  CompensateRollingShutter({{1, 2, 3}, {4, 5, 6}, {7, 8, 9}, {10, 11, 12}}, keyframe);
  EXPECT_EQ(keyframe.corners[0].pixel, Eigen::Vector2f(100, 200));
}

}  // namespace
}  // namespace pangea::vio
