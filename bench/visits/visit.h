#pragma once

// Another visit of what a recording saw: its keyframes under a new map id, with fresh noise on
// pixels, descriptors, depths and odometry.

#include <cstdint>
#include <vector>

#include "core/keyframe.h"

namespace pangea::bench {

// `keyframes`: of one map, from seq 0. The same `visit` gives the same noise.
std::vector<Keyframe> VisitAgain(const std::vector<Keyframe>& keyframes, int64_t opened_utime,
                                 uint64_t visit);

}  // namespace pangea::bench
