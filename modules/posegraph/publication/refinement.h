#pragma once

// A bundle adjustment's poses laid over the pose graph's solution.
//
// The graph goes on solving as if there were none: no measurement counts twice, and what it decides
// (groups, loops in force) does not depend on when a refinement comes. Where poses are told, those
// of refined keyframes are the refinement's, as a whole rotated about z and shifted to lie best on
// the solution, and other keyframes keep their place in the solution relative to the refined one
// before them. A newer refinement replaces an older one of the same maps; one whose maps are no
// longer in one group is not used.

#include <map>
#include <utility>
#include <vector>

#include "core/server_messages.h"
#include "posegraph/odometry_chain.h"
#include "posegraph/solver/four_dof.h"

namespace pangea {

class Refinement {
 public:
  explicit Refinement(const MapState& refined);

  int64_t revision() const { return revision_; }
  const std::vector<MapId>& maps() const { return maps_; }
  bool SharesMapWith(const Refinement& other) const;
  // By (map, seq); in the refinement's own frame.
  const std::map<KeyframeId, Rigid3>& poses() const { return poses_; }

 private:
  int64_t revision_;
  std::vector<MapId> maps_;  // ascending
  std::map<KeyframeId, Rigid3> poses_;
};

// The rotation about z and the shift that lay the second points of the pairs best on the first.
Pose4 FitYawAndShift(const std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>>& pairs);

// One map's poses as they are told.
class RefinedMap {
 public:
  RefinedMap(const OdometryChain& chain, const std::vector<Pose4>& solved)
      : chain_(chain), solved_(solved) {}

  // Nodes in ascending order.
  void Add(int node, const Rigid3& T_map_body) { refined_.emplace_back(node, T_map_body); }

  Rigid3 T_map_body(int node) const;
  // What it does to the solution about a node.
  Pose4 Shift(int node) const;

 private:
  using Refined = std::pair<int, Rigid3>;
  // The last one not after the node, or the first; null when there are none.
  const Refined* Before(int node) const;

  const OdometryChain& chain_;
  const std::vector<Pose4>& solved_;
  std::vector<Refined> refined_;
};

}  // namespace pangea
