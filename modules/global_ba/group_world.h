#pragma once

// A group as the bundle adjustment starts with it: the pose graph's poses, the odometry's
// velocities and biases, the landmarks.

#include <vector>

#include "core/server_messages.h"
#include "core/submap_store.h"
#include "global_ba/landmarks.h"
#include "global_ba/redundancy.h"

namespace pangea {

// Two keyframes that an accepted constraint joins, with the corners that place_recognition matched.
struct MatchedPlaces {
  KeyframeId query;
  KeyframeId match;
  std::vector<std::pair<int, int>> corners;  // (query's, match's)
};

struct GroupWorldOptions {
  LandmarkOptions landmarks;
  RedundancyOptions redundancy;
};

// Keyframes of the state that the store does not have, and redundant ones, are left out.
BaWorld MakeGroupWorld(const MapState& state, const std::vector<MatchedPlaces>& places,
                       const GroupWorldOptions& options, SubmapStore* store);

}  // namespace pangea
