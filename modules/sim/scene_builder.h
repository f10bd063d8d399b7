#pragma once

// Builds the scenes: a machine hall, small rooms, and two rooms that differ in everything but a
// dozen identical objects, which stand at different places in each.

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "sim/scene.h"

namespace pangea::sim {

enum class SceneKind { kHall, kRoom, kTwinObjectsA, kTwinObjectsB };

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
