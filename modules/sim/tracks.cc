#include "sim/tracks.h"

#include <algorithm>
#include <cmath>

#include "sim/random.h"

namespace pangea::sim {
namespace {

// Points where random rays from inside the room meet it: dense on what is near and in view.
std::vector<Eigen::Vector3d> ScatterLandmarks(const Scene& scene, uint64_t seed) {
  constexpr int kLandmarks = 12000;
  Rng rng(seed, "landmarks");
  std::vector<Eigen::Vector3d> landmarks;
  for (int i = 0; i < kLandmarks; ++i) {
    Eigen::Vector3f origin;
    Eigen::Vector3f direction;
    for (int axis = 0; axis < 3; ++axis) {
      const auto share = static_cast<float>(rng.Uniform());
      origin[axis] = scene.room_min[axis] + share * (scene.room_max[axis] - scene.room_min[axis]);
      direction[axis] = static_cast<float>(rng.Normal());
    }
    direction.normalize();
    if (const auto hit = scene.Cast(origin, direction)) {
      landmarks.emplace_back((origin + hit->range * direction).cast<double>());
    }
  }
  return landmarks;
}

}  // namespace

TrackMaker::TrackMaker(const Scene& scene, const CameraModel& camera, int count, uint64_t seed)
    : scene_(scene), camera_(camera), count_(count), landmarks_(ScatterLandmarks(scene, seed)) {}

bool TrackMaker::Visible(const Rigid3& T_ref_cam, const Eigen::Vector3d& landmark,
                         Eigen::Vector2d* pixel) const {
  constexpr double kNearest = 0.2;
  const Eigen::Vector3d p_cam = T_ref_cam.Inverse() * landmark;
  const double range = p_cam.norm();
  if (p_cam.z() < kNearest) {
    return false;
  }
  const auto projected = camera_.Project(p_cam);
  if (!projected || !camera_.Contains(*projected, 1)) {
    return false;
  }
  const Eigen::Vector3d direction = (landmark - T_ref_cam.t) / range;
  const auto hit = scene_.Cast(T_ref_cam.t.cast<float>(), direction.cast<float>());
  constexpr double kTolerance = 2e-3;
  if (!hit || hit->range < range * (1 - kTolerance)) {
    return false;
  }
  *pixel = *projected;
  return true;
}

std::vector<TrackedPoint> TrackMaker::Next(const Rigid3& T_ref_cam) {
  std::vector<TrackedPoint> points;
  const int across = std::max(1, static_cast<int>(std::sqrt(1.5 * count_)));
  const int down = (count_ + across - 1) / across;
  std::vector<int> taken(static_cast<size_t>(across * down), 0);
  const auto cell = [&](const Eigen::Vector2d& pixel) {
    const int x = std::clamp(static_cast<int>(pixel.x() * across / camera_.width), 0, across - 1);
    const int y = std::clamp(static_cast<int>(pixel.y() * down / camera_.height), 0, down - 1);
    return static_cast<size_t>(y * across + x);
  };
  const auto add = [&](int32_t id, int most_in_cell) {
    Eigen::Vector2d pixel;
    const Eigen::Vector3d& landmark = landmarks_[static_cast<size_t>(id)];
    if (static_cast<int>(points.size()) < count_ && Visible(T_ref_cam, landmark, &pixel) &&
        taken[cell(pixel)] < most_in_cell) {
      ++taken[cell(pixel)];
      points.push_back({id, pixel});
    }
  };
  constexpr int kCrowded = 4;
  for (const int32_t id : followed_) {
    add(id, kCrowded);
  }
  for (int32_t id = 0; id < static_cast<int32_t>(landmarks_.size()); ++id) {
    if (static_cast<int>(points.size()) >= count_) {
      break;
    }
    if (std::ranges::find(followed_, id) == followed_.end()) {
      add(id, 1);
    }
  }
  followed_.clear();
  for (const TrackedPoint& point : points) {
    followed_.push_back(point.landmark_id);
  }
  return points;
}

}  // namespace pangea::sim
