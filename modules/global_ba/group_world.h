#pragma once

// A group, or a part of it, as the bundle adjustment starts with it: the pose graph's poses, the
// odometry's velocities and biases, or where it was adjusted before the adjustment's, and the
// landmarks.

#include <vector>

#include "core/server_messages.h"
#include "core/submap_store.h"
#include "global_ba/adjusted_group.h"
#include "global_ba/local_part.h"

namespace pangea {

// Two keyframes that an accepted constraint joins, with the corners that place_recognition matched.
struct MatchedPlaces {
  KeyframeId query;
  KeyframeId match;
  std::vector<std::pair<int, int>> corners;  // (query's, match's)
};

// Keyframes of the state that the store does not have, and redundant ones, are left out.
BaWorld MakeGroupWorld(const MapPoses& state, const std::vector<MatchedPlaces>& places,
                       SubmapStore* store);

// The part alone. A map's camera is held if most of its keyframes stay where they are: they know
// more of it.
BaWorld MakeLocalWorld(const MapPoses& state, const LocalPart& part, const AdjustedGroup& adjusted,
                       const std::vector<MatchedPlaces>& places, SubmapStore* store);

}  // namespace pangea
