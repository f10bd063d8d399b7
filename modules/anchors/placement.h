#pragma once

// Places the anchor of an edit: relative to the keyframes around it, never as a pose in a map
// frame, so that it moves with the keyframes.

#include <string>
#include <variant>
#include <vector>

#include "anchors/odometry_track.h"
#include "core/anchor.h"

namespace pangea {

// Only keyframes up to this long before and after an edit are used: they hold the anchor, and their
// map points give the surface behind a pixel.
inline constexpr int64_t kPlacementReach_us = 5'000'000;

// One keyframe that holds an anchor.
struct Hold {
  int32_t seq = 0;  // in the placement's map
  Rigid3 T_body_anchor;
  double weight = 0;  // the weights of an anchor add up to 1
};

struct AnchorPlacement {
  MapId map;
  std::vector<Hold> holds;  // at least one
  // Of T_odom_anchor when it was placed: the editor's covariance, or that of the surface's depth,
  // plus a small floor. The odometry between the keyframes that hold it is not included.
  Matrix6d covariance = Matrix6d::Identity();
};

// A needed keyframe has not arrived: the edit's own, or one at or after its time.
struct AwaitsKeyframe {};
struct NotPlaced {
  std::string reason;
};
using PlacementResult = std::variant<AnchorPlacement, AwaitsKeyframe, NotPlaced>;

// `track`: the keyframes of the edit's map received so far. `holds`: maximum number of keyframes.
// `ended`: no later keyframe will come; so those up to kPlacementReach_us before an edit that has
// its own pose do.
// An anchor on a surface is upright: its z axis points up, its x axis horizontally to the viewer.
PlacementResult Place(const AnchorEdit& edit, const OdometryTrack& track, int holds,
                      bool ended = false);

}  // namespace pangea
