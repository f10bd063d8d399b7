#pragma once

// An accepted constraint whose keyframes are both known, as the pose graph works with it.

#include <cstdint>

#include "posegraph/odometry_chain.h"
#include "posegraph/solver/four_dof.h"

namespace pangea {

struct NodeRef {
  int map = 0;   // number of the map in the order it was first seen
  int node = 0;  // index in its chain
  auto operator<=>(const NodeRef&) const = default;
};

struct Loop {
  int64_t id = 0;  // Constraint::Id
  NodeRef from;
  NodeRef to;
  Relative4 relative;
  int num_inliers = 0;
  bool derived = false;  // stands for constraints that merged its maps before
  // Weight it had in the last solve: in force or switched off.
  bool on = true;

  bool intra() const { return from.map == to.map; }
};

}  // namespace pangea
