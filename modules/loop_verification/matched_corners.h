#pragma once

// Landmarks of corners that no track gave a depth: matched between the newest keyframe of a window
// and its neighbours along the epipolar lines of the odometry, and triangulated from its poses.
//
// An odometry gives depths to corners that it tracked long enough; on real phones that is one
// landmark in four (docs/decisions/real_revisits.md). What the keyframes describe beside those
// repeats in its neighbours all the same.

#include "loop_verification/window.h"

namespace pangea {

// Nothing is added to a window with more than few_landmarks. `after`: keyframes of the map behind
// the newest one, ascending.
void TriangulateMatchedCorners(const TriangulationOptions& options, const KeyframeWindow& after,
                               Window* window);

}  // namespace pangea
