#include "core/group_states.h"

namespace pangea {

void GroupStates::Take(const MapState& state) {
  auto group = std::make_shared<GroupState>();
  group->id = state.group;
  group->revision = state.revision;
  for (const KeyframePose& pose : state.keyframes) {
    group->T_map_body[pose.id] = pose.T_map_body;
  }
  for (const MapId& map : state.maps) {
    auto& known = newest_[map];
    if (known == nullptr || known->revision < group->revision) {
      known = group;
    }
  }
}

const GroupState* GroupStates::Find(const MapId& map) const {
  const auto found = newest_.find(map);
  return found == newest_.end() ? nullptr : found->second.get();
}

}  // namespace pangea
