#pragma once

// What an adjustment leaves of a group: where the next one, which may be local, begins.

#include <map>
#include <optional>

#include "core/group_states.h"
#include "global_ba/ba_problem.h"

namespace pangea {

struct AdjustedGroup {
  // Those it knew; nothing for one that was left out. In a map frame of its own.
  std::map<KeyframeId, std::optional<ImuState>> keyframes;
  std::map<MapId, BaCamera> cameras;

  bool Knows(const KeyframeId& id) const { return keyframes.contains(id); }
  // Null for one that was left out or is not known.
  const ImuState* Find(const KeyframeId& id) const;
  // Whether a state has its shape: the same steps from keyframe to keyframe.
  bool IsShapeOf(const MapPoses& state) const;
};

// The same motion where a state, which has the shape of the adjustment, has the keyframe.
ImuState MovedTo(const Rigid3& T_map_body, const ImuState& adjusted);

// After the adjustment of a world, of a group as `state` has it. `before`: the last one's, for what
// the world does not have or holds; null if the world is all of the group.
AdjustedGroup AfterAdjustment(const BaWorld& world, const MapPoses& state,
                              const AdjustedGroup* before);

}  // namespace pangea
