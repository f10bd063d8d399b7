#pragma once

// The newest state of each group of fused maps, found by any of its maps.

#include <cstdint>
#include <map>
#include <memory>

#include "core/ids.h"
#include "core/rigid3.h"
#include "core/server_messages.h"

namespace pangea {

// Where keyframes are in the map frame of their group.
using MapPoses = std::map<KeyframeId, Rigid3>;

struct GroupState {
  MapId id;
  int64_t revision = 0;
  MapPoses T_map_body;
};

class GroupStates {
 public:
  // For each map the state with the highest revision counts, in whatever order they come.
  void Take(const MapState& state);

  // Null when no state has named the map.
  const GroupState* Find(const MapId& map) const;

 private:
  std::map<MapId, std::shared_ptr<const GroupState>> newest_;
};

}  // namespace pangea
