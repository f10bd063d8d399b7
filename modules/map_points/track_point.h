#pragma once

// A track of some odometry as a point of the fused map: triangulated from every keyframe that
// tracked it, where the group's state has them.

#include <Eigen/Core>
#include <optional>

#include "core/group_states.h"
#include "core/keyframe.h"
#include "core/submap_store.h"

namespace pangea {

// Of a tracked corner, with what neighbouring poses add; pixels.
inline constexpr double kTrackPointSigma_px = 1.0;

struct TrackPoint {
  Eigen::Vector3d p_map = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();
};

// `corner` of `source` must be a landmark's. Nothing when the rays do not say where it is.
std::optional<TrackPoint> PointOfTrack(const MapPoses& poses, const KeyframeView& source,
                                       int corner, SubmapStore* store);

}  // namespace pangea
