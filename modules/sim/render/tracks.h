#pragma once

// Exact feature tracks: the pixels of fixed points on the scene's surfaces. A point is followed as
// long as it is visible; new points fill the empty cells.

#include <cstdint>
#include <optional>
#include <vector>

#include "core/camera_model.h"
#include "sim/scene/scene.h"

namespace pangea::sim {

struct TrackedPoint {
  int32_t landmark_id = 0;
  Eigen::Vector2d pixel;  // raw (distorted)
};

class TrackMaker {
 public:
  // Scene and camera must outlive it. `count`: points per frame, if that many are visible.
  TrackMaker(const Scene& scene, const CameraModel& camera, int count, uint64_t seed);

  const std::vector<Eigen::Vector3d>& landmarks() const { return landmarks_; }
  // Call in time order. T_ref_cam: one pose for all rows, or one per row, as in Renderer::Render.
  std::vector<TrackedPoint> Next(const std::vector<Rigid3>& T_ref_cam);

 private:
  // Pixel of a landmark, and the pose of the row at this pixel.
  std::optional<Eigen::Vector2d> PixelOf(const std::vector<Rigid3>& T_ref_cam,
                                         const Eigen::Vector3d& landmark, Rigid3* pose) const;
  bool Hidden(const Eigen::Vector3d& eye, const Eigen::Vector3d& landmark) const;

  const Scene& scene_;
  const CameraModel& camera_;
  int count_;
  std::vector<Eigen::Vector3d> landmarks_;
  std::vector<int32_t> followed_;
};

}  // namespace pangea::sim
