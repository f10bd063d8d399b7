#pragma once

// Reduces the corners of a keyframe, for a link with a budget. Pose, edge and preintegration stay
// as they are, so the chain of poses has no gap.

#include "core/keyframe.h"

namespace pangea {

// Keeps the corners that are tracked or are map points, and at most `untracked` of the others: the
// same share of each octave. The first ones of an octave are kept, because the describer puts
// strong and well distributed corners first.
Keyframe Thinned(Keyframe keyframe, int untracked);

// The keyframe without corners and map points.
Keyframe Bare(Keyframe keyframe);

}  // namespace pangea
