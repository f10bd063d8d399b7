#pragma once

// Where an edit puts an anchor: relative to the keyframes around it, so that it follows whatever
// moves them, and never as a pose in a map frame.

#include <string>
#include <variant>
#include <vector>

#include "anchors/odometry_track.h"
#include "core/anchor.h"

namespace pangea {

// Keyframes up to so long before and after an edit decide where it puts an anchor: they hold it,
// and are the map around a pixel.
inline constexpr int64_t kPlacementReach_us = 5'000'000;

// One keyframe that holds an anchor.
struct Hold {
  int32_t seq = 0;  // of the placement's map
  Rigid3 T_body_anchor;
  double weight = 0;  // all of an anchor add up to 1
};

struct AnchorPlacement {
  MapId map;
  std::vector<Hold> holds;
  // Of T_odom_anchor when it was placed: what the editor said or the surface's depth, and the
  // odometry to the keyframes that hold it.
  Matrix6d covariance = Matrix6d::Identity();
};

struct AwaitsKeyframe {};  // one at or after the edit's time is still to come
struct NotPlaced {
  std::string reason;
};
using PlacementResult = std::variant<AnchorPlacement, AwaitsKeyframe, NotPlaced>;

// `track`: of the edit's map, as far as it has come. `holds`: keyframes at most. An anchor on a
// surface stands upright: its z axis up, x horizontally towards the viewer.
PlacementResult Place(const AnchorEdit& edit, const OdometryTrack& track, int holds);

}  // namespace pangea
