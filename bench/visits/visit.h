#pragma once

// Simulates another visit: a recording's keyframes with a new map id, and with new noise on pixels,
// descriptors, depths and odometry.

#include <cstdint>
#include <vector>

#include "core/keyframe.h"

namespace pangea::bench {

// `keyframes`: of one map, from seq 0 on. The same `visit` gives the same noise.
std::vector<Keyframe> VisitAgain(const std::vector<Keyframe>& keyframes, int64_t opened_utime,
                                 uint64_t visit);

}  // namespace pangea::bench
