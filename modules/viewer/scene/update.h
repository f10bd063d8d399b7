#pragma once

// The update message to a page: what the page does not have yet, in one block of bytes,
// little-endian.
//
//   uint32   length of the JSON text, a multiple of 4 (padded with spaces)
//   JSON     everything small: clock, maps, agents, verification results, processes, fusions,
//            anchors; and the numbers of records
//   records  "keyframes": uint32 index, map, seq, number of points; float32 T_odom_body (x y z, qw
//            qx qy qz); then the points, float32 x y z in the body frame
//            "solved": uint32 keyframe index, group (a map's index); float32 T_map_body (7)
//            "view": the view of the watched agent's camera, if it is new to the page: uint32
//            number of tracks; for each track uint32 number of pixels, and float32 u v of each
//            pixel, newest first; uint32 size of the image, and its bytes, padded to 4
//
// page/src/protocol.ts reads it.

#include <cstdint>
#include <vector>

#include "viewer/show.h"

namespace pangea::viewer {

// What a page has already received.
struct Seen {
  int64_t epoch = -1;  // -1: nothing yet
  uint64_t version = 0;
  ShowClock clock;
  int32_t watched = 0;  // the agent whose camera view it shows; 0: none
  int64_t view = 0;     // AgentView::number() of the last view sent
};

// Whether EncodeUpdate would contain anything new. The clock alone is sent every 100 ms.
bool HasUpdate(const Show& show, const Seen& seen);

// Encodes the next update, with about `budget` bytes of records at most; the rest follows with the
// next update. Updates `seen`.
std::vector<uint8_t> EncodeUpdate(const Show& show, size_t budget, Seen* seen);

}  // namespace pangea::viewer
