#pragma once

// A keyframe with fewer corners, for a link that must not carry them all. Pose, edge and
// preintegration stay as they are, so the chain of poses has no gap.

#include "core/keyframe.h"

namespace pangea {

// Keeps the corners that are tracked or map points, and of the others at most `untracked`: the same
// share of each octave, from its front, where the describer puts the strongest, well spread.
Keyframe Thinned(Keyframe keyframe, int untracked);

// No corner, no map point.
Keyframe Bare(Keyframe keyframe);

}  // namespace pangea
