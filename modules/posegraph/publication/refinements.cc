#include "posegraph/publication/refinements.h"

#include <algorithm>
#include <utility>

namespace pangea {
namespace {

using PointPairs = std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>>;

Rigid3 SolvedPose(const GraphMap& map, int node) {
  const Pose4& solved = map.poses[node];
  return {YawRotation(solved.yaw) * map.chain[node].T_odom_body.q, solved.p};
}

// A keyframe counts by points around its body, so that also rotations show the yaw: the positions
// of an agent that stands still do not.
void AddPointsAround(const Rigid3& to, const Rigid3& from, PointPairs* pairs) {
  constexpr double kArm_m = 1;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double arm : {-kArm_m, kArm_m}) {
      const Eigen::Vector3d p_body = arm * Eigen::Vector3d::Unit(axis);
      pairs->emplace_back(to * p_body, from * p_body);
    }
  }
}

// Fits the whole refinement to the solution and adds its poses to `told`.
void Lay(const Refinement& refinement, const GraphMaps& maps, std::map<int, RefinedMap>* told) {
  std::vector<std::pair<NodeRef, Rigid3>> nodes;
  PointPairs points;
  for (const auto& [id, pose] : refinement.poses()) {
    if (const std::optional<NodeRef> node = maps.Find(id)) {
      nodes.emplace_back(*node, pose);
      AddPointsAround(SolvedPose(maps[node->map], node->node), pose, &points);
    }
  }
  if (nodes.empty()) {
    return;
  }
  const Rigid3 T_map_refined = FitYawAndShift(points).ToRigid3();
  for (const auto& [node, pose] : nodes) {
    told->at(node.map).Add(node.node, T_map_refined * pose);
  }
}

}  // namespace

bool Refinements::Add(const MapState& refined, const GraphMaps& maps) {
  const Refinement refinement(refined);
  const auto known = [&maps](const MapId& map) { return maps.Number(map).has_value(); };
  const auto shares = [&](const Refinement& held) { return held.SharesMapWith(refinement); };
  const auto as_new = [&](const Refinement& held) {
    return shares(held) && held.revision() >= refinement.revision();
  };
  if (refinement.maps().empty() || !std::ranges::all_of(refinement.maps(), known) ||
      std::ranges::any_of(refinements_, as_new)) {
    return false;
  }
  std::erase_if(refinements_, shares);
  refinements_.push_back(refinement);
  return true;
}

std::map<int, RefinedMap> Refinements::Refine(const std::vector<int>& group,
                                              const GraphMaps& maps) const {
  std::map<int, RefinedMap> told;
  for (const int number : group) {
    told.try_emplace(number, maps[number].chain, maps[number].poses);
  }
  for (const Refinement& refinement : refinements_) {
    const auto here = [&](const MapId& map) { return told.contains(*maps.Number(map)); };
    if (std::ranges::all_of(refinement.maps(), here)) {
      Lay(refinement, maps, &told);
    }
  }
  return told;
}

}  // namespace pangea
