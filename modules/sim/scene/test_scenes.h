#pragma once

// Small scenes and paths for this module's tests.

#include <cmath>

#include "recording/trajectory.h"
#include "sim/scene/scene.h"

namespace pangea::sim {

// An empty room of 10 m around the origin, in a single grey except for a disc on the wall x = 5,
// centre (5, 0.8, 0.4).
inline const Eigen::Vector3d kDisc(5, 0.8, 0.4);

inline Scene RoomWithDisc(int grey, int disc_grey) {
  constexpr float kTexel = 0.01f;
  Scene scene;
  scene.room_min.setConstant(-5);
  scene.room_max.setConstant(5);
  cv::Mat plain(8, 8, CV_8U, cv::Scalar(grey));
  // Anti-aliased: the share of the texel covered by the disc.
  cv::Mat wall(1000, 1000, CV_8U);
  constexpr double kRadius = 0.08;
  for (int y = 0; y < wall.rows; ++y) {
    for (int x = 0; x < wall.cols; ++x) {
      const double r =
          std::hypot((x + 0.5) * 0.01 - 5 - kDisc.y(), (y + 0.5) * 0.01 - 5 - kDisc.z());
      const double share = std::min(1.0, std::max(0.0, (kRadius - r) / 0.01 + 0.5));
      wall.at<uint8_t>(y, x) = static_cast<uint8_t>(grey + share * (disc_grey - grey));
    }
  }
  for (const cv::Mat& sheet : {plain, wall}) {
    Surface surface;
    surface.texture = Texture(sheet, kTexel, false);
    surface.detail_gain = 0;
    scene.surfaces.push_back(surface);
  }
  scene.detail = Texture(plain, kTexel, true);
  scene.room_surfaces = {0, 1, 0, 0, 0, 0};
  return scene;
}

// A lively path of the body, at 200 Hz: circles, bobbing and rotating about all axes.
inline Trajectory LivelyPath(double duration_s) {
  Trajectory trajectory;
  for (int i = 0; i <= static_cast<int>(200 * duration_s); ++i) {
    const double t = i / 200.0;
    StampedPose pose;
    pose.utime = 1'000'000'000 + 5000 * static_cast<int64_t>(i);
    pose.T.t = {2 * std::sin(0.9 * t), 1.5 * std::cos(0.7 * t), 0.4 * std::sin(2.1 * t)};
    pose.T.q =
        Eigen::Quaterniond(Eigen::AngleAxisd(0.8 * t, Eigen::Vector3d::UnitZ()) *
                           Eigen::AngleAxisd(0.5 * std::sin(1.3 * t), Eigen::Vector3d::UnitY()) *
                           Eigen::AngleAxisd(0.4 * std::sin(1.9 * t), Eigen::Vector3d::UnitX()));
    trajectory.push_back(pose);
  }
  return trajectory;
}

}  // namespace pangea::sim
