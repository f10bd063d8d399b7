#pragma once

#include <vector>

#include "core/keyframe.h"
#include "core/server_messages.h"

namespace pangea::bench {

// A keyframe with its match and verification results.
struct Step {
  Keyframe keyframe;
  PlaceMatch match;
  std::vector<Constraint> results;
};

}  // namespace pangea::bench
