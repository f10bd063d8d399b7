#pragma once

// The paper's RANSAC with a fundamental matrix, on the matches of a projection search (section
// IV.D).

#include <vector>

#include "loop_verification/correspondences/point_observation.h"

namespace pangea {

// Tests the matches between the two newest keyframes: those observed in the newest keyframe of one
// window, whose landmark is seen by the newest keyframe of the other. Drops those that contradict
// the best fundamental matrix by more than `max_error_px`; all other matches are kept. With fewer
// than `min_pairs` tested matches nothing is dropped, because eight points fit any matrix.
std::vector<PointMatch> FilterByFundamental(const WindowPair& windows,
                                            const std::vector<PointMatch>& matches,
                                            double max_error_px, int min_pairs);

}  // namespace pangea
