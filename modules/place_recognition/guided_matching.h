#pragma once

// The second matching, when a relative pose is known: a corner has few rivals near its epipolar
// line, so corners on repeated texture that failed the first ratio test are matched too.

#include <utility>
#include <vector>

#include "core/matching.h"
#include "place_recognition/epipolar_check.h"

namespace pangea {

// A keyframe's corners and their rays, with the same indices; a ray with sigma 0 is unusable.
struct CornersAndRays {
  const std::vector<Corner>& corners;
  const std::vector<CornerRay>& rays;
};

// Near the epipolar line there are far fewer rivals, so the ratio test is looser.
inline MatchingOptions GuidedMatching(DescriptorKind kind) {
  return {.max_distance = LimitsOf(kind).alike, .max_ratio = 0.9};
}

// Returns mutual nearest neighbours, as (corner of a, corner of b) in the order of a, among the
// pairs with a residual up to kMaxEpipolarResidual; `model` maps a to b. `pairs`: all pairs with a
// descriptor distance up to RivalDistance(matching) or more (see PairsWithin).
std::vector<std::pair<int, int>> MatchAlongEpipolarLines(std::vector<CornerMatch> pairs,
                                                         const CornersAndRays& a,
                                                         const CornersAndRays& b,
                                                         const EpipolarModel& model,
                                                         const MatchingOptions& matching);

}  // namespace pangea
