#pragma once

// A track of some odometry as a point of the fused map: triangulated from every keyframe that
// tracked it, where the group's state has them.

#include <Eigen/Core>
#include <optional>

#include "core/group_states.h"
#include "core/keyframe.h"
#include "core/submap_store.h"

namespace pangea {

struct TrackPointOptions {
  double sigma_px = 1.0;  // of a tracked corner, with what neighbouring poses add
  int min_rays = 3;
  double max_relative_sigma = 0.1;  // of the distance

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Add("sigma_px", &sigma_px, {0.01, 20}, "px",
                "of a tracked corner, with what neighbouring poses add");
    archive.Add("min_rays", &min_rays, {2, 1000}, "", "of a landmark");
    archive.Add("max_relative_sigma", &max_relative_sigma, {0.001, 1}, "", "of the distance");
  }
};

struct TrackPoint {
  Eigen::Vector3d p_map = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();
};

// `corner` of `source` must be a landmark's. Nothing when the rays do not say where it is.
std::optional<TrackPoint> PointOfTrack(const MapPoses& poses, const KeyframeView& source,
                                       int corner, const TrackPointOptions& options,
                                       SubmapStore* store);

}  // namespace pangea
