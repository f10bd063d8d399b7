#pragma once

// Which maps are fused into which group: finds the newest state of a group by any of its maps.
// For each map the state with the highest revision counts, in any order of arrival. A map that has
// left its group keeps the last state that named it, but that state is no longer current.

#include <algorithm>
#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <utility>
#include <vector>

#include "core/ids.h"
#include "core/rigid3.h"
#include "core/server_messages.h"

namespace pangea {

// How a new state changes which maps are in one group.
struct Regrouping {
  bool fused = false;  // maps that were apart are now together
  bool split = false;  // maps that were together are now apart
};

// `State` holds the part of a MapState that the user needs. It has MapState's `revision` and
// `maps`.
template <typename State>
class GroupStates {
 public:
  using Pointer = std::shared_ptr<const State>;

  // The state becomes the newest one of each of its maps that has no newer state.
  Pointer Take(State state) {
    auto taken = std::make_shared<const State>(std::move(state));
    for (const MapId& map : taken->maps) {
      Pointer& newest = newest_[map];
      if (newest == nullptr || newest->revision < taken->revision) {
        newest = taken;
      }
    }
    return taken;
  }

  // What Take(state) would change; nothing if no map's newest state is older.
  Regrouping RegroupedBy(const State& state) const {
    const std::set<MapId> maps(state.maps.begin(), state.maps.end());
    std::set<const State*> before;  // the states of these maps
    size_t num_alone = 0;           // maps without a state
    bool is_newer = false;
    for (const MapId& map : maps) {
      const State* const newest = Find(map);
      is_newer |= newest == nullptr || newest->revision < state.revision;
      if (newest == nullptr) {
        ++num_alone;
      } else {
        before.insert(newest);
      }
    }
    if (!is_newer) {
      return {};
    }
    const bool split = std::ranges::any_of(newest_, [&](const auto& other) {
      return before.contains(other.second.get()) && !maps.contains(other.first);
    });
    return {before.size() + num_alone > 1, split};
  }

  // Null when no state has named the map.
  const State* Find(const MapId& map) const {
    const auto found = newest_.find(map);
    return found == newest_.end() ? nullptr : found->second.get();
  }

  // Whether `state`, as returned by Take or Find, is the newest state of all its maps: no map has
  // left the group since.
  bool IsCurrent(const State& state) const {
    return std::ranges::all_of(state.maps, [&](const MapId& map) { return Find(map) == &state; });
  }

  // Whether the map is now in a group with other maps.
  bool IsFused(const MapId& map) const {
    const State* const state = Find(map);
    return state != nullptr && state->maps.size() > 1 && IsCurrent(*state);
  }

  const std::map<MapId, Pointer>& by_map() const { return newest_; }

 private:
  std::map<MapId, Pointer> newest_;
};

// The smallest State for GroupStates.
struct GroupMaps {
  int64_t revision = 0;
  std::vector<MapId> maps;
};

// T_map_body of keyframes, in the map frame of their group.
using MapPoses = std::map<KeyframeId, Rigid3>;

inline MapPoses PosesOf(const MapState& state) {
  MapPoses poses;
  for (const KeyframePose& pose : state.keyframes) {
    poses[pose.id] = pose.T_map_body;
  }
  return poses;
}

// A State for GroupStates that keeps the keyframe poses.
struct PosedGroup {
  explicit PosedGroup(const MapState& state)
      : id(state.group), revision(state.revision), maps(state.maps), T_map_body(PosesOf(state)) {}

  MapId id;
  int64_t revision = 0;
  std::vector<MapId> maps;
  MapPoses T_map_body;
};

}  // namespace pangea
