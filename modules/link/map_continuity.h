#pragma once

// Checks that keyframes of one map belong together, in any order of arrival: they have the same
// camera, whose focal length, centre and distortion may change a little, and time increases with
// seq. A keyframe that fails comes from a broken or hostile agent. Bounded: only the newest
// kMaxMaps maps, and the newest kMaxKeyframes keyframes of each, are remembered.

#include <cstdint>
#include <map>
#include <string>

#include "core/keyframe.h"

namespace pangea {

class MapContinuity {
 public:
  static constexpr size_t kMaxMaps = 200;
  static constexpr size_t kMaxKeyframes = 200;

  // Returns why the keyframe cannot belong to its map; or an empty string, and then remembers it.
  // `contents`: a checksum of its bytes if a repeat must be identical, 0 if it may differ.
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
