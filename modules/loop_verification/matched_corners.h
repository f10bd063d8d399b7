#pragma once

// Adds landmarks for corners without a depth: matches them between the newest keyframe of a window
// and its neighbours along the odometry's epipolar lines, and triangulates them with the odometry's
// poses.
//
// The odometry gives a depth only to corners that it tracked long enough; on real phones that is
// one landmark in four (docs/decisions/real_revisits.md). Many of the other corners also repeat in
// neighbouring keyframes.

#include "loop_verification/window.h"

namespace pangea {

// Adds nothing to a window with more than few_landmarks. `after`: the keyframes that follow the
// window's newest one, ascending.
void TriangulateMatchedCorners(const TriangulationOptions& options, const KeyframeWindow& after,
                               Window* window);

}  // namespace pangea
