#pragma once

// Builds the bundle adjustment's initial world of a group or a part of it. Poses are those of the
// state; velocities and biases come from the odometry, or from the previous adjustment if there is
// one; landmarks are triangulated.

#include <vector>

#include "core/keyframe_store.h"
#include "core/server_messages.h"
#include "global_ba/adjusted_group.h"
#include "global_ba/local_part.h"

namespace pangea {

// Two keyframes of an accepted (or redundant) candidate, with their matched corners.
struct MatchedPair {
  KeyframeId query;
  KeyframeId match;
  std::vector<std::pair<int, int>> corners;  // (query's, match's)
};

// Leaves out keyframes that the store does not have, and redundant ones (redundancy.h).
BaWorld MakeGroupWorld(const MapPoses& state, const std::vector<MatchedPair>& pairs,
                       KeyframeStore* store);

// Only the part. A map's camera is fixed if most of the map's keyframes are: they have more
// information on it.
BaWorld MakeLocalWorld(const MapPoses& state, const LocalPart& part, const AdjustedGroup& adjusted,
                       const std::vector<MatchedPair>& pairs, KeyframeStore* store);

}  // namespace pangea
