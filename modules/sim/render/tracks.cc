#include "sim/render/tracks.h"

#include <algorithm>
#include <cmath>

#include "sim/random.h"

namespace pangea::sim {
namespace {

// Points where random rays from inside the room meet its surfaces: dense on near and visible ones.
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

std::optional<Eigen::Vector2d> TrackMaker::PixelOf(const std::vector<Rigid3>& T_ref_cam,
                                                   const Eigen::Vector3d& landmark,
                                                   Rigid3* pose) const {
  *pose = T_ref_cam[T_ref_cam.size() / 2];
  constexpr double kNearest = 0.2;
  constexpr int kRowIterations = 3;
  for (int i = 0;; ++i) {
    const Eigen::Vector3d p_cam = pose->Inverse() * landmark;
    auto pixel = p_cam.z() < kNearest ? std::nullopt : camera_.Project(p_cam);
    if (!pixel || !camera_.Contains(*pixel, 1)) {
      return std::nullopt;
    }
    if (T_ref_cam.size() == 1 || i == kRowIterations) {
      return pixel;
    }
    *pose = T_ref_cam[static_cast<size_t>(std::lround(pixel->y()))];
  }
}

bool TrackMaker::Hidden(const Eigen::Vector3d& eye, const Eigen::Vector3d& landmark) const {
  const double range = (landmark - eye).norm();
  const Eigen::Vector3d direction = (landmark - eye) / range;
  const auto hit = scene_.Cast(eye.cast<float>(), direction.cast<float>());
  constexpr double kTolerance = 2e-3;
  return !hit || hit->range < range * (1 - kTolerance);
}

std::vector<TrackedPoint> TrackMaker::Next(const std::vector<Rigid3>& T_ref_cam) {
  std::vector<TrackedPoint> points;
  const int across = std::max(1, static_cast<int>(std::sqrt(1.5 * count_)));
  const int down = (count_ + across - 1) / across;
  std::vector<int> taken(static_cast<size_t>(across * down), 0);
  const auto add = [&](int32_t id, int most_in_cell) {
    const Eigen::Vector3d& landmark = landmarks_[static_cast<size_t>(id)];
    Rigid3 pose;
    const auto pixel = PixelOf(T_ref_cam, landmark, &pose);
    if (!pixel || static_cast<int>(points.size()) >= count_) {
      return;
    }
    const int x = std::clamp(static_cast<int>(pixel->x() * across / camera_.width), 0, across - 1);
    const int y = std::clamp(static_cast<int>(pixel->y() * down / camera_.height), 0, down - 1);
    const int cell = y * across + x;
    int& in_cell = taken[static_cast<size_t>(cell)];
    if (in_cell < most_in_cell && !Hidden(pose.t, landmark)) {
      ++in_cell;
      points.push_back({id, *pixel});
    }
  };
  constexpr int kCrowded = 4;
  for (const int32_t id : followed_) {
    add(id, kCrowded);
  }
  for (int32_t id = 0; id < static_cast<int32_t>(landmarks_.size()); ++id) {
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
