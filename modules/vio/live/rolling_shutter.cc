#include "vio/live/rolling_shutter.h"

#include <optional>
#include <vector>

namespace pangea::vio {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// The camera that exposed a row, seen from the camera at the image's time.
Rigid3 RowCamera(const CameraModel& camera, const BodyMotion& motion, double row) {
  const double s = camera.readout_s * row / (camera.height - 1);
  const Rigid3 T_body_later(ExpSo3(s * motion.omega), s * motion.v);
  return camera.T_body_cam.Inverse() * T_body_later * camera.T_body_cam;
}

}  // namespace

void TakeOutReadout(const BodyMotion& motion, Keyframe& keyframe) {
  const CameraModel& camera = keyframe.camera;
  if (camera.readout_s <= 0 || camera.height < 2) {
    return;
  }
  std::vector<MapPoint*> point_of(keyframe.corners.size(), nullptr);
  for (MapPoint& point : keyframe.points) {
    point_of[static_cast<size_t>(point.corner)] = &point;
  }
  for (size_t i = 0; i < keyframe.corners.size(); ++i) {
    Corner& corner = keyframe.corners[i];
    const auto ray = camera.Unproject(corner.pixel.cast<double>());
    if (!ray) {
      continue;
    }
    const Rigid3 T_cam_row = RowCamera(camera, motion, static_cast<double>(corner.pixel.y()));
    const double rho = point_of[i] != nullptr ? static_cast<double>(point_of[i]->inverse_depth) : 0;
    // (x, y, z) * rho, so that a point at infinity is no special case.
    const Vector3d moved = T_cam_row.q * Vector3d(ray->x(), ray->y(), 1) + rho * T_cam_row.t;
    const auto pixel = camera.Project(moved);
    if (!pixel || !camera.Contains(*pixel)) {
      continue;
    }
    corner.pixel = pixel->cast<float>();
    if (point_of[i] != nullptr) {
      const double ratio = 1 / moved.z();
      point_of[i]->inverse_depth = static_cast<float>(rho * ratio);
      point_of[i]->inverse_depth_var *= static_cast<float>(ratio * ratio);
    }
  }
}

}  // namespace pangea::vio
