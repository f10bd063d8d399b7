#pragma once

// A loop closure of the pose graph: an accepted constraint whose two keyframes are both known.

#include <cstdint>
#include <optional>

#include "core/tags/tag.h"
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
  // For a merge by itself: made by thinning, in place of constraints that had merged the two maps;
  // or by a tag that both keyframes see.
  bool sufficient = false;
  std::optional<TagId> tag;  // of a constraint by a tag
  // Result of the last solve: true if the loop is in force, false if the solve switched it off.
  bool on = true;

  bool intra() const { return from.map == to.map; }
};

}  // namespace pangea
