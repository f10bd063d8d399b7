#pragma once

// Builds the scenes: a machine hall, a hall with hardly a mark in it, small rooms; and pairs that
// are easily mistaken for one another: two rooms that differ in everything but a dozen identical
// objects, which stand at different places in each, and two halls with the same machines in rows
// and the same things along the walls, every few metres.

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "sim/scene/scene.h"

namespace pangea::sim {

enum class SceneKind { kHall, kRoom, kTwinObjectsA, kTwinObjectsB, kBareHall, kRowsA, kRowsB };

constexpr bool IsHall(SceneKind kind) {
  return kind == SceneKind::kHall || kind == SceneKind::kBareHall || kind == SceneKind::kRowsA ||
         kind == SceneKind::kRowsB;
}

struct SceneOptions {
  SceneKind kind = SceneKind::kHall;
  uint64_t seed = 1;  // changes everything
  // Points of the paths the scene must contain and stay clear of. Without any, the paths of
  // path_generator.h are kept clear. The scene depends on them: recordings of one scene need the
  // same ones.
  std::vector<Eigen::Vector3d> keep_clear;
  double clearance_m = 0.8;
  // Multiplies the size of a texel: above 1 the scene is built faster and looks softer close up.
  double coarseness = 1.0;
};

Scene BuildScene(const SceneOptions& options);

}  // namespace pangea::sim
