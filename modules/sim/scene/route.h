#pragma once

// The route of generated paths, which generated scenes keep clear: a figure of eight.

#include <Eigen/Core>
#include <cmath>

#include "sim/scene/scene_builder.h"

namespace pangea::sim {

struct Route {
  double length_m;  // half extent along x
  double width_m;   // half extent along y
  double low_m;     // range of heights of the paths
  double high_m;
  double sideways_m;  // sideways deviation of the paths

  // phase 0 .. 2 pi is one round.
  Eigen::Vector2d At(double phase) const {
    return {length_m * std::sin(phase), width_m * std::sin(2 * phase)};
  }
};

inline Route RouteOf(SceneKind kind) {
  return IsHall(kind) ? Route{7.0, 3.8, 0.5, 3.0, 0.5} : Route{1.5, 0.8, 0.8, 1.7, 0.15};
}

}  // namespace pangea::sim
