#pragma once

// The message to a page: what it lacks of a show, in one block of bytes, little-endian.
//
//   uint32   length of the JSON text, a multiple of 4 (padded with spaces)
//   JSON     clock, maps, agents, verification results, processes, fusions, anchors: what is small;
//            and the counts of records
//   records  "keyframes": uint32 index, map, seq, number of points; float32 T_odom_body (x y z, qw
//            qx qy qz); then the points, float32 x y z in the body frame
//            "solved": uint32 keyframe index, group (a map's index); float32 T_map_body (7)
//            "view": what the watched agent's camera saw, if it is new to the page: uint32 number
//            of tracks; of each uint32 number of pixels and float32 u v of each, newest first;
//            uint32 bytes of the image, and these, padded to 4
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
  int32_t watched = 0;  // the agent whose camera it looks through; 0: none's
  int64_t view = 0;     // AgentView::number() of it
};

// Whether EncodeUpdate would say anything new. A page is told of time passing every 100 ms.
bool HasUpdate(const Show& show, const Seen& seen);

// At most about `budget` bytes of records; what is left comes with the next. Moves `seen` on.
std::vector<uint8_t> EncodeUpdate(const Show& show, size_t budget, Seen* seen);

}  // namespace pangea::viewer
