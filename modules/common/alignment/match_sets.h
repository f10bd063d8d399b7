#pragma once

// Sets of point matches between two windows, before any geometry.

#include <vector>

#include "common/alignment/point_observation.h"
#include "common/server_messages.h"

namespace pangea {

// The candidate's matched corners that have a depth, in either keyframe or by their landmark in a
// neighbour.
std::vector<PointMatch> CandidateMatches(const Window& window_m, const Window& window_c,
                                         const PlaceCandidate& candidate);

// Each landmark and corner once.
std::vector<PointMatch> Distinct(const std::vector<PointMatch>& matches);

// Of the keyframes' votes on which landmark of the other window a landmark is, the majority stays;
// corners that are no landmark vote for nothing and stay.
std::vector<PointMatch> Agreeing(const Window& window_m, const Window& window_c,
                                 const std::vector<PointMatch>& matches);

}  // namespace pangea
