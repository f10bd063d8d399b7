#pragma once

// The message to a page: what it lacks of a show, in one block of bytes, little-endian.
//
//   uint32   length of the JSON text, a multiple of 4 (padded with spaces)
//   JSON     clock, maps, agents, verdicts, processes, fusions: what is small; and the counts of
//   records  "keyframes": uint32 index, map, seq, number of points; float32 T_odom_body (x y z, qw
//            qx qy qz); then the points, float32 x y z in the body frame
//            "solved": uint32 keyframe index, group (a map's index); float32 T_map_body (7)
//
// page/src/protocol.ts reads it.

#include <cstdint>
#include <vector>

#include "viewer/show.h"

namespace pangea::viewer {

// How far a page has been told.
struct Seen {
  int64_t epoch = -1;  // none yet
  uint64_t version = 0;
  ShowClock clock;
};

// Whether EncodeUpdate would say anything new. A page is told of time passing every 100 ms.
bool HasNews(const Show& show, const Seen& seen);

// At most about `budget` bytes of records; what is left comes with the next. Moves `seen` on.
std::vector<uint8_t> EncodeUpdate(const Show& show, size_t budget, Seen* seen);

}  // namespace pangea::viewer
