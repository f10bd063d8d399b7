#pragma once

// Which maps are fused, as MAP_STATE says it. The highest revision wins, map by map.

#include <cstdint>
#include <map>
#include <vector>

#include "core/ids.h"

namespace pangea {

class MapGroups {
 public:
  void Set(const MapId& group, int64_t revision, const std::vector<MapId>& maps);

  // Whether the map is one with others.
  bool IsFused(const MapId& map) const;

 private:
  struct State {
    MapId group;
    int64_t revision = -1;
    bool fused = false;
  };
  std::map<MapId, State> states_;
};

}  // namespace pangea
