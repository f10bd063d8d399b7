#pragma once

// Triangulates a track of an odometry as a point of the fused map, from all keyframes that tracked
// it, with their poses in the group's state.

#include <Eigen/Core>
#include <optional>

#include "core/group_states.h"
#include "core/keyframe.h"
#include "core/keyframe_store.h"

namespace pangea {

// Sigma of a tracked corner, including errors of neighbouring poses; pixels.
inline constexpr double kTrackPointSigma_px = 1.0;

struct TrackPoint {
  Eigen::Vector3d p_map = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();
};

// `corner` of `source` must have a landmark_id. Empty if the rays do not determine the point.
std::optional<TrackPoint> PointOfTrack(const MapPoses& poses, const KeyframeView& source,
                                       int corner, KeyframeStore* store);

}  // namespace pangea
