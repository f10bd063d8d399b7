#pragma once

// The paper's fundamental-matrix RANSAC over the matches of a projection search (section IV.D).

#include <vector>

#include "loop_verification/correspondences/point_observation.h"

namespace pangea {

// Drops the matches in the newest keyframe of one window whose landmark is also seen in the newest
// keyframe of the other, where the two corners contradict the fundamental matrix most of them
// agree on. With fewer than `min_pairs` of them nothing is dropped: eight points fit anything.
std::vector<PointMatch> FilterByFundamental(const WindowPair& windows,
                                            const std::vector<PointMatch>& matches,
                                            double max_error_px, int min_pairs);

}  // namespace pangea
