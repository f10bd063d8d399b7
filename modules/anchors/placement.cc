#include "anchors/placement.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <set>
#include <utility>

#include "anchors/surface.h"

namespace pangea {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kMinDepth_m = 0.1;
constexpr double kPixelSigma = 1;
// Sigmas of an anchor without a given covariance: placed by hand.
constexpr double kUnknownSigma_m = 0.01, kUnknownSigma_rad = 0.02;
constexpr double kFloorSigma_m = 0.001, kFloorSigma_rad = 0.0005;

struct Pose {
  Rigid3 T_odom_anchor;
  Matrix6d covariance;
};

struct Viewer {
  Rigid3 T_odom_cam;
  const CameraModel& camera;
};

Matrix6d Diagonal(double sigma_m, double sigma_rad) {
  Vector6d variances;
  variances << Vector3d::Constant(sigma_m * sigma_m), Vector3d::Constant(sigma_rad * sigma_rad);
  return variances.asDiagonal();
}

// The map points of keyframes around this time, each once, in the viewer's camera.
std::vector<SurfacePoint> PointsInView(const OdometryTrack& track, int64_t utime,
                                       const Viewer& viewer) {
  const Rigid3 T_cam_odom = viewer.T_odom_cam.Inverse();
  std::vector<SurfacePoint> points;
  std::set<int32_t> landmarks;
  // The newest keyframe with a landmark has its best estimate.
  for (auto it = track.keyframes().rbegin(); it != track.keyframes().rend(); ++it) {
    const TrackedKeyframe& keyframe = it->second;
    if (std::abs(keyframe.utime - utime) > kPlacementReach_us) {
      continue;
    }
    const Rigid3 T_cam_source = T_cam_odom * keyframe.T_odom_cam();
    for (const TrackedPoint& point : track.Points(keyframe)) {
      const Vector3d p_cam = T_cam_source * Vector3d(point.p_cam.cast<double>());
      if (p_cam.z() < kMinDepth_m ||
          (point.landmark_id != kNoLandmark && !landmarks.insert(point.landmark_id).second)) {
        continue;
      }
      points.push_back(
          {p_cam.head<2>() / p_cam.z(), 1 / p_cam.z(), point.relative_depth_sigma / p_cam.z()});
    }
  }
  return points;
}

// Upright, facing the camera.
Rigid3 Upright(const Rigid3& T_odom_cam, const Vector3d& p_cam) {
  const Vector3d p_odom = T_odom_cam * p_cam;
  const Vector3d to_camera = T_odom_cam.t - p_odom;
  return {YawRotation(std::atan2(to_camera.y(), to_camera.x())), p_odom};
}

// From the first row of a rolling shutter, which the image's time and pose are of, to the pixel's.
int64_t RowTime_us(const CameraModel& camera, const Vector2d& pixel) {
  return std::llround(1e6 * camera.RowTime_s(std::clamp(pixel.y(), 0.0, camera.height - 1.0)));
}

// The body's pose at the edit's time or soon after it: the edit's own pose, moved on as the
// odometry moved.
std::optional<Rigid3> BodyAt(int64_t utime, const AnchorEdit& edit, const OdometryTrack& track) {
  const auto then = track.Between(edit.utime), now = track.Between(utime);
  if (!edit.T_odom_body) {
    return then ? now : std::nullopt;
  }
  return utime != edit.utime && then && now ? *edit.T_odom_body * (then->Inverse() * *now)
                                            : edit.T_odom_body;
}

std::optional<Pose> OnSurface(const AnchorEdit& edit, const OdometryTrack& track,
                              const Viewer& viewer) {
  const auto ray = viewer.camera.Unproject(edit.pixel);
  if (!ray) {
    return std::nullopt;
  }
  const auto depth = DepthBehind(*ray, PointsInView(track, edit.utime, viewer));
  if (!depth) {
    return std::nullopt;
  }
  const Vector3d p_cam = depth->depth_m * Vector3d(ray->x(), ray->y(), 1);
  const Vector3d along = viewer.T_odom_cam.q * p_cam.normalized();
  const double sigma_along = depth->sigma_m * p_cam.norm() / depth->depth_m;
  const double sigma_across = kPixelSigma * viewer.camera.PixelAngle() * p_cam.norm();
  Matrix6d covariance = Diagonal(sigma_across, kUnknownSigma_rad);
  covariance.topLeftCorner<3, 3>() +=
      (sigma_along * sigma_along - sigma_across * sigma_across) * along * along.transpose();
  return Pose{Upright(viewer.T_odom_cam, p_cam), covariance};
}

bool Sees(const TrackedKeyframe& keyframe, const Vector3d& p_odom) {
  const Vector3d p_cam = keyframe.T_odom_cam().Inverse() * p_odom;
  const auto pixel = p_cam.z() > kMinDepth_m ? keyframe.camera->Project(p_cam) : std::nullopt;
  return pixel && keyframe.camera->Contains(*pixel);
}

// Chooses the keyframes that hold the anchor: those nearest in time that see it, or of all if none
// does. The weight is the inverse variance of the odometry between the keyframe and the placement.
// If no odometry leads to any of them, or none is near in time, the nearest keyframe holds it.
AnchorPlacement HoldBy(const OdometryTrack& track, int64_t utime, const Pose& pose, int count) {
  std::vector<std::pair<int64_t, int32_t>> seeing, blind;  // (microseconds away, seq)
  for (const auto& [seq, keyframe] : track.keyframes()) {
    if (const int64_t away_us = std::abs(keyframe.utime - utime); away_us <= kPlacementReach_us) {
      (Sees(keyframe, pose.T_odom_anchor.t) ? seeing : blind).emplace_back(away_us, seq);
    }
  }
  std::vector<std::pair<int64_t, int32_t>>& chosen = seeing.empty() ? blind : seeing;
  std::ranges::sort(chosen);
  chosen.resize(std::min<size_t>(chosen.size(), count));

  AnchorPlacement placement;
  double total = 0;
  const auto hold_by = [&](int32_t seq, double weight) {
    const Rigid3 T_body_odom = track.Find(seq)->T_odom_body.Inverse();
    placement.holds.push_back({seq, T_body_odom * pose.T_odom_anchor, weight});
    total += weight;
  };
  const int32_t nearest = track.Nearest(utime)->first;
  for (const auto& [away_us, seq] : chosen) {
    const auto [variance_m2, variance_rad2] = track.Drift(nearest, seq);
    const double lever_m = (pose.T_odom_anchor.t - track.Find(seq)->T_odom_body.t).norm();
    const double weight =
        1 / (kFloorSigma_m * kFloorSigma_m + variance_m2 + variance_rad2 * lever_m * lever_m);
    if (weight > 0) {  // not across a gap, where the variance is infinite (or NaN)
      hold_by(seq, weight);
    }
  }
  if (placement.holds.empty()) {
    hold_by(nearest, 1);
  }
  for (Hold& hold : placement.holds) {
    hold.weight /= total;
  }
  placement.covariance = pose.covariance + Diagonal(kFloorSigma_m, kFloorSigma_rad);
  return placement;
}

PlacementResult Held(const AnchorEdit& edit, const OdometryTrack& track, int64_t utime,
                     const Pose& pose, int holds) {
  AnchorPlacement placement = HoldBy(track, utime, pose, holds);
  placement.map = edit.map;
  return placement;
}

// The editor's covariance is of T_ref_anchor, in the reference frame.
Pose Relative(const AnchorEdit& edit, const Rigid3& T_odom_ref) {
  const Matrix6d own = edit.covariance.value_or(Diagonal(kUnknownSigma_m, kUnknownSigma_rad));
  return {T_odom_ref * edit.T_ref_anchor,
          ComposeCovariance(T_odom_ref, Matrix6d::Zero(), edit.T_ref_anchor, own)};
}

}  // namespace

PlacementResult Place(const AnchorEdit& edit, const OdometryTrack& track, int holds, bool ended) {
  if (edit.placement == AnchorEdit::Placement::kKeyframe) {
    const TrackedKeyframe* const keyframe = track.Find(edit.keyframe_seq);
    if (keyframe == nullptr) {
      return AwaitsKeyframe();
    }
    return Held(edit, track, keyframe->utime, Relative(edit, keyframe->T_odom_body), holds);
  }
  // A quick test: an edit whose time is wrong waits for ever, and is tried with each keyframe.
  if (track.keyframes().empty()) {
    return AwaitsKeyframe();
  }
  const int64_t last_utime = track.keyframes().rbegin()->second.utime;
  const int64_t reach_us = ended && edit.T_odom_body ? kPlacementReach_us : 0;
  if (last_utime < edit.utime - reach_us) {
    return AwaitsKeyframe();
  }
  const bool on_surface = edit.placement == AnchorEdit::Placement::kPixel;
  const CameraModel& camera = *track.Nearest(edit.utime)->second.camera;
  int64_t seen_utime = edit.utime + (on_surface ? RowTime_us(camera, edit.pixel) : 0);
  if (last_utime < seen_utime) {
    if (!ended) {
      return AwaitsKeyframe();
    }
    seen_utime = std::max(last_utime, edit.utime);
  }
  const auto T_odom_body = BodyAt(seen_utime, edit, track);
  if (!T_odom_body) {
    return NotPlaced{"it is from before the map's first keyframe"};
  }
  if (!on_surface) {
    return Held(edit, track, edit.utime, Relative(edit, *T_odom_body), holds);
  }
  const auto pose = OnSurface(edit, track, {*T_odom_body * camera.T_body_cam, camera});
  if (!pose) {
    return NotPlaced{"the map has no surface behind this pixel"};
  }
  return Held(edit, track, edit.utime, *pose, holds);
}

}  // namespace pangea
