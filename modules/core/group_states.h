#pragma once

// Which maps are fused into which group: the newest state of each group, found by any of its maps.
// For each map the state with the highest revision counts, in whatever order they come. A map that
// has left its group keeps the state that named it last, which is current no more.

#include <algorithm>
#include <cstdint>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "core/ids.h"
#include "core/rigid3.h"
#include "core/server_messages.h"

namespace pangea {

// `State`: what is kept of a MapState; it has `revision` and `maps` as that has them.
template <typename State>
class GroupStates {
 public:
  using Pointer = std::shared_ptr<const State>;

  // All maps that it is the newest of share it.
  Pointer Take(State state) {
    const auto taken = std::make_shared<const State>(std::move(state));
    for (const MapId& map : taken->maps) {
      Pointer& newest = newest_[map];
      if (newest == nullptr || newest->revision < taken->revision) {
        newest = taken;
      }
    }
    return taken;
  }

  // Null when no state has named the map.
  const State* Find(const MapId& map) const {
    const auto found = newest_.find(map);
    return found == newest_.end() ? nullptr : found->second.get();
  }

  // Whether it, which was taken, is the newest of all its maps: none of them has left.
  bool IsCurrent(const State& state) const {
    return std::ranges::all_of(state.maps, [&](const MapId& map) { return Find(map) == &state; });
  }

  // Whether the map is one with others.
  bool IsFused(const MapId& map) const {
    const State* const state = Find(map);
    return state != nullptr && state->maps.size() > 1 && IsCurrent(*state);
  }

  const std::map<MapId, Pointer>& by_map() const { return newest_; }

 private:
  std::map<MapId, Pointer> newest_;
};

// Where keyframes are in the map frame of their group.
using MapPoses = std::map<KeyframeId, Rigid3>;

inline MapPoses PosesOf(const MapState& state) {
  MapPoses poses;
  for (const KeyframePose& pose : state.keyframes) {
    poses[pose.id] = pose.T_map_body;
  }
  return poses;
}

// A state as it is kept by who looks for poses.
struct PosedGroup {
  explicit PosedGroup(const MapState& state)
      : id(state.group), revision(state.revision), maps(state.maps), T_map_body(PosesOf(state)) {}

  MapId id;
  int64_t revision = 0;
  std::vector<MapId> maps;
  MapPoses T_map_body;
};

}  // namespace pangea
