#include "vio/live/rolling_shutter.h"

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "core/median.h"

namespace pangea::vio {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Pose of the camera at the exposure of a row, relative to the camera at the image's time.
Rigid3 RowCamera(const CameraModel& camera, const BodyMotion& motion, double row) {
  return camera.T_body_cam.Inverse() * motion.After(camera.RowTime_s(row)) * camera.T_body_cam;
}

struct SeenDepth {
  Eigen::Vector2f pixel;
  float inverse_depth;
};

std::vector<SeenDepth> SeenDepths(const Keyframe& keyframe) {
  std::vector<SeenDepth> seen;
  for (const MapPoint& point : keyframe.points) {
    seen.push_back(
        {keyframe.corners[static_cast<size_t>(point.corner)].pixel, point.inverse_depth});
  }
  return seen;
}

// Median inverse depth of the map points nearest in the image; 0 if there are none.
double InverseDepthNear(const Eigen::Vector2f& pixel, const std::vector<SeenDepth>& seen) {
  constexpr size_t kNearest = 5;
  if (seen.empty()) {
    return 0;
  }
  std::vector<std::pair<float, float>> by_distance;  // squared pixels, 1/m
  for (const SeenDepth& at : seen) {
    by_distance.emplace_back((at.pixel - pixel).squaredNorm(), at.inverse_depth);
  }
  const size_t num = std::min(kNearest, by_distance.size());
  std::partial_sort(by_distance.begin(), by_distance.begin() + static_cast<std::ptrdiff_t>(num),
                    by_distance.end());
  std::vector<float> nearest;
  for (size_t i = 0; i < num; ++i) {
    nearest.push_back(by_distance[i].second);
  }
  return static_cast<double>(Median(std::move(nearest)));
}

struct Moved {
  Eigen::Vector2f pixel;
  double z = 1;  // of a point that was at z = 1
};

// Where a global shutter would have seen the pixel; nothing if outside the image.
std::optional<Moved> ByGlobalShutter(const CameraModel& camera, const BodyMotion& motion,
                                     const Eigen::Vector2f& pixel, double inverse_depth) {
  const auto ray = camera.Unproject(pixel.cast<double>());
  if (!ray) {
    return std::nullopt;
  }
  const Rigid3 T_cam_row = RowCamera(camera, motion, static_cast<double>(pixel.y()));
  // Scaled by the inverse depth, so that a point at infinity is no special case.
  const Vector3d moved =
      T_cam_row.q * Vector3d(ray->x(), ray->y(), 1) + inverse_depth * T_cam_row.t;
  const auto to = camera.Project(moved);
  if (!to || !camera.Contains(*to)) {
    return std::nullopt;
  }
  return Moved{to->cast<float>(), moved.z()};
}

void CompensateTags(const BodyMotion& motion, const std::vector<SeenDepth>& seen,
                    Keyframe& keyframe) {
  for (TagObservation& tag : keyframe.tags) {
    for (Eigen::Vector2f& corner : tag.corners) {
      if (const auto moved =
              ByGlobalShutter(keyframe.camera, motion, corner, InverseDepthNear(corner, seen))) {
        corner = moved->pixel;
      }
    }
  }
}

}  // namespace

void CompensateRollingShutter(const BodyMotion& motion, Keyframe& keyframe) {
  const CameraModel& camera = keyframe.camera;
  if (camera.readout_s <= 0) {
    return;
  }
  std::vector<MapPoint*> point_of(keyframe.corners.size(), nullptr);
  for (MapPoint& point : keyframe.points) {
    point_of[static_cast<size_t>(point.corner)] = &point;
  }
  const std::vector<SeenDepth> seen = SeenDepths(keyframe);
  for (size_t i = 0; i < keyframe.corners.size(); ++i) {
    Corner& corner = keyframe.corners[i];
    const double rho = point_of[i] != nullptr ? static_cast<double>(point_of[i]->inverse_depth)
                                              : InverseDepthNear(corner.pixel, seen);
    const auto moved = ByGlobalShutter(camera, motion, corner.pixel, rho);
    if (!moved) {
      continue;
    }
    corner.pixel = moved->pixel;
    if (point_of[i] != nullptr) {
      const double ratio = 1 / moved->z;
      point_of[i]->inverse_depth = static_cast<float>(rho * ratio);
      point_of[i]->inverse_depth_var *= static_cast<float>(ratio * ratio);
    }
  }
  CompensateTags(motion, seen, keyframe);
}

}  // namespace pangea::vio
