#pragma once

// When the gaps of numbered streams are asked for: after a moment in which they may close by
// themselves, a part at a time; the next part once that has come.

#include <cstdint>
#include <map>
#include <vector>

#include "core/ids.h"

namespace pangea {

class GapRequests {
 public:
  // The parts to ask for now, of the first gap of each map.
  std::vector<SeqGap> Due(const std::vector<SeqGap>& gaps, int64_t now_utime);
  // The map's gap does not close by itself: it is asked for at once.
  void Expect(const MapId& map);
  // Requests for what the map lacks first, the one that is due among them.
  int Requests(const MapId& map) const;

 private:
  static constexpr int32_t kNothing = -2;  // no seq, and before none

  struct Asked {
    int32_t from_seq = kNothing;  // the first that is missing
    int32_t to_seq = kNothing;    // the last that was asked for
    int64_t next_utime = 0;
    int times = 0;
  };
  std::map<MapId, Asked> asked_;
};

}  // namespace pangea
