#pragma once

// Lays the poses of a bundle adjustment over the solution of the pose graph.
//
// The graph solves as if there were no refinement: so no measurement counts twice, and its
// decisions (groups, loops in force) do not depend on when a refinement arrives. Only published
// poses change. A refined keyframe gets its refined pose, after the refinement as a whole is
// rotated about z and shifted to fit the solution best. Every other keyframe keeps its pose
// relative to the refined keyframe before it. A newer refinement replaces an older one that shares
// a map with it. A refinement whose maps are no longer all in one group is not used.

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
  // By (map, seq), only of keyframes of `maps`; in the refinement's own frame.
  const std::map<KeyframeId, Rigid3>& poses() const { return poses_; }

 private:
  int64_t revision_;
  std::vector<MapId> maps_;  // ascending
  std::map<KeyframeId, Rigid3> poses_;
};

// The rotation about z and the shift T that minimise sum |first - T * second|^2 over the pairs.
Pose4 FitYawAndShift(const std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>>& pairs);

// The published poses of one map.
class RefinedMap {
 public:
  RefinedMap(const OdometryChain& chain, const std::vector<Pose4>& solved)
      : chain_(chain), solved_(solved) {}

  // Adds a refined pose; call in ascending order of nodes.
  void Add(int node, const Rigid3& T_map_body) { refined_.emplace_back(node, T_map_body); }

  Rigid3 T_map_body(int node) const;
  // The displacement, in the map frame, from the solution to the published poses near a node.
  Pose4 Shift(int node) const;

 private:
  using Refined = std::pair<int, Rigid3>;
  // The last refined node that is not after `node`, else the first one; null if there is none.
  const Refined* Before(int node) const;

  const OdometryChain& chain_;
  const std::vector<Pose4>& solved_;
  std::vector<Refined> refined_;
};

}  // namespace pangea
