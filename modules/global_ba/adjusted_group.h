#pragma once

// The result of adjusting a group; the next adjustment, which may be local, starts from it.

#include <map>
#include <optional>

#include "core/group_states.h"
#include "global_ba/ba_problem.h"

namespace pangea {

struct AdjustedGroup {
  // All keyframes that it knew; the value is empty for one that was left out (redundant). The
  // states are in a map frame of its own.
  std::map<KeyframeId, std::optional<KeyframeState>> keyframes;
  std::map<MapId, BaCamera> cameras;

  bool Knows(const KeyframeId& id) const { return keyframes.contains(id); }
  // Null for a keyframe that was left out or is unknown.
  const KeyframeState* Find(const KeyframeId& id) const;
  // Whether a state has the same shape: distances between successive keyframes agree to 0.1 mm.
  bool IsShapeOf(const MapPoses& state) const;
};

// The adjusted state of a keyframe, moved to the pose `T_map_body`: velocity is rotated along.
KeyframeState MovedTo(const Rigid3& T_map_body, const KeyframeState& adjusted);

// The result after adjusting `world`, for a group with the poses `state`. `before`: the previous
// result, used for keyframes that the world lacks or keeps fixed; null if the world is the whole
// group.
AdjustedGroup AfterAdjustment(const BaWorld& world, const MapPoses& state,
                              const AdjustedGroup* before);

}  // namespace pangea
