#pragma once

// A second matching once a relative pose is known: along the epipolar line a corner has few rivals,
// so repeated texture that failed the ratio test of the first matching finds its partner.

#include <utility>
#include <vector>

#include "core/matching.h"
#include "place_recognition/epipolar_check.h"

namespace pangea {

// A keyframe's corners and their rays, index by index; a ray of sigma 0 is unusable.
struct CornersAndRays {
  const std::vector<Corner>& corners;
  const std::vector<CornerRay>& rays;
};

// Guided by the epipolar line there are far fewer rivals: the ratio test can be wider.
inline constexpr MatchingOptions kGuidedMatching{.max_distance = kAlikeHamming, .max_ratio = 0.9};

// Mutual nearest neighbours among the pairs within kMaxEpipolarResidual of the model (which takes a
// to b), as (corner of a, corner of b), in the order of a. `pairs`: PairsWithin RivalDistance at
// least.
std::vector<std::pair<int, int>> MatchAlongEpipolarLines(std::vector<CornerMatch> pairs,
                                                         const CornersAndRays& a,
                                                         const CornersAndRays& b,
                                                         const EpipolarModel& model);

}  // namespace pangea
