#include "place_recognition/map_groups.h"

namespace pangea {

void MapGroups::Set(const MapId& group, int64_t revision, const std::vector<MapId>& maps) {
  // A map that has left the group stands alone again until another group names it.
  for (auto& [map, state] : states_) {
    if (state.group == group && state.revision <= revision) {
      state = {map, revision, false};
    }
  }
  for (const MapId& map : maps) {
    State& state = states_[map];
    if (state.revision <= revision) {
      state = {group, revision, maps.size() > 1};
    }
  }
}

bool MapGroups::IsFused(const MapId& map) const {
  const auto state = states_.find(map);
  return state != states_.end() && state->second.fused;
}

}  // namespace pangea
