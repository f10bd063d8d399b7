#pragma once

// What makes keyframes of one map a sequence, whatever order they come in: one camera, whose focal
// length, centre and distortion may move a little, and time that goes forward with seq. A keyframe
// that breaks it is from a broken or hostile agent. Bounded: the newest maps, and of each the
// newest keyframes, are remembered.

#include <cstdint>
#include <map>
#include <string>

#include "core/keyframe.h"

namespace pangea {

class MapContinuity {
 public:
  static constexpr size_t kMaxMaps = 200;
  static constexpr size_t kMaxKeyframes = 200;

  // Why the keyframe cannot be of its map, or an empty string; then it is remembered. `contents`: a
  // checksum of the bytes where a repeat has to be the same as before, 0 where it may differ.
  std::string Check(const Keyframe& keyframe, size_t contents);

 private:
  struct Seen {
    int64_t utime = 0;
    size_t contents = 0;
  };
  struct OpenMap {
    CameraModel camera;
    std::map<int32_t, Seen> seen;  // by seq
  };
  std::map<MapId, OpenMap> maps_;
};

}  // namespace pangea
