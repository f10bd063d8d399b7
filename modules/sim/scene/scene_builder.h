#pragma once

// Builds the scenes: a machine hall, a hall with hardly any texture, small rooms; and pairs that
// are easily confused: two different rooms with a dozen identical objects at different places, and
// two halls with the same machines in rows and the same objects along the walls, every few metres.

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "sim/scene/scene.h"
#include "sim/scene/wall_tags.h"

namespace pangea::sim {

enum class SceneKind { kHall, kRoom, kTwinObjectsA, kTwinObjectsB, kBareHall, kRowsA, kRowsB };

constexpr bool IsHall(SceneKind kind) {
  return kind == SceneKind::kHall || kind == SceneKind::kBareHall || kind == SceneKind::kRowsA ||
         kind == SceneKind::kRowsB;
}

struct SceneOptions {
  SceneKind kind = SceneKind::kHall;
  uint64_t seed = 1;  // another seed gives another scene
  // Points of the paths, which the scene must contain and keep clear. If empty, the paths of
  // path_generator.h are kept clear. The scene depends on these points: recordings of one scene
  // need the same ones.
  std::vector<Eigen::Vector3d> keep_clear;
  double clearance_m = 0.8;
  // Factor on the size of a texel: above 1 the scene is built faster, but near surfaces look
  // blurred.
  double coarseness = 1.0;
  std::optional<WallTags> tags;
};

Scene BuildScene(const SceneOptions& options);

}  // namespace pangea::sim
