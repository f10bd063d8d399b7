#pragma once

// Decides when the gaps of numbered streams are asked for. A gap is first given time to close by
// itself. Then it is asked for in parts: each part once the part before it has come (timeouts.h).

#include <cstdint>
#include <map>
#include <vector>

#include "core/ids.h"

namespace pangea {

class GapRequests {
 public:
  // The parts to ask for now. `gaps`: the first gap of each map.
  std::vector<SeqGap> Due(const std::vector<SeqGap>& gaps, int64_t now_utime);
  // The first gap of this map will not close by itself, so it is asked for at once.
  void Expect(const MapId& map);
  // Number of requests so far for the first missing part of the map, with the one that Due
  // returned.
  int Requests(const MapId& map) const;

 private:
  static constexpr int32_t kNothing = -2;  // no seq: neither one of a gap nor the one before it

  struct Asked {
    int32_t from_seq = kNothing;  // the first that is missing
    int32_t to_seq = kNothing;    // the last that was asked for
    int64_t next_utime = 0;
    int times = 0;
  };
  std::map<MapId, Asked> asked_;
};

}  // namespace pangea
