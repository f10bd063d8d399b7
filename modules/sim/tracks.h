#pragma once

// Exact feature tracks: persistent points of the scene's surfaces, where they appear in each frame.
// A point once seen is followed for as long as it is visible; new ones fill the empty cells.

#include <cstdint>
#include <vector>

#include "common/camera_model.h"
#include "sim/scene.h"

namespace pangea::sim {

struct TrackedPoint {
  int32_t landmark_id = 0;
  Eigen::Vector2d pixel;  // raw (distorted)
};

class TrackMaker {
 public:
  // Both must outlive it. `count` points a frame, where that many are visible.
  TrackMaker(const Scene& scene, const CameraModel& camera, int count, uint64_t seed);

  const std::vector<Eigen::Vector3d>& landmarks() const { return landmarks_; }
  // Call in order of time. T_ref_cam of the first row; a rolling shutter is not modelled.
  std::vector<TrackedPoint> Next(const Rigid3& T_ref_cam);

 private:
  bool Visible(const Rigid3& T_ref_cam, const Eigen::Vector3d& landmark,
               Eigen::Vector2d* pixel) const;

  const Scene& scene_;
  const CameraModel& camera_;
  int count_;
  std::vector<Eigen::Vector3d> landmarks_;
  std::vector<int32_t> followed_;
};

}  // namespace pangea::sim
