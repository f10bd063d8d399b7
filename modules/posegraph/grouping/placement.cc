#include "posegraph/grouping/placement.h"

#include <tuple>
#include <vector>

namespace pangea {
namespace {

struct Placed {
  int map = 0;
  Pose4 T_map_odom;
};

using Merges = std::vector<const MapPair*>;

Merges MergesOf(const GraphGroup& group, const MapPairs& pairs) {
  Merges merges = pairs.Among(group.maps);
  std::erase_if(merges, [](const MapPair* pair) { return !pair->merged(); });
  return merges;
}

// Chooses and places the next map of a group in which at least one map is placed.
Placed PlaceNext(const Merges& merges, const std::set<int>& placed, const GraphMaps& maps) {
  const auto rank = [&maps](const MapPair& pair) {
    return std::tuple(-pair.evidence.decision().viewpoints, maps[pair.a].id, maps[pair.b].id);
  };
  const MapPair* best = nullptr;
  for (const MapPair* pair : merges) {
    const bool leads_on = placed.contains(pair->a) != placed.contains(pair->b);
    if (leads_on && (best == nullptr || rank(*pair) < rank(*best))) {
      best = pair;
    }
  }
  const Pose4 T_a_b = best->evidence.Alignment();
  return placed.contains(best->a) ? Placed{best->b, maps[best->a].T_map_odom * T_a_b}
                                  : Placed{best->a, maps[best->b].T_map_odom * T_a_b.Inverse()};
}

}  // namespace

void PlaceMaps(const GraphGroup& group, const MapPairs& pairs, GraphMaps* maps) {
  const Merges merges = MergesOf(group, pairs);
  std::set<int> placed = {group.oldest()};
  (*maps)[group.oldest()].T_map_odom = {};
  while (placed.size() < group.maps.size()) {
    const Placed next = PlaceNext(merges, placed, *maps);
    (*maps)[next.map].T_map_odom = next.T_map_odom;
    placed.insert(next.map);
  }
  for (const int number : group.maps) {
    GraphMap& map = (*maps)[number];
    map.log_scale = 0;
    map.PlaceByOdometry(0);
    map.newest_solved = -1;
    map.covariance.setZero();
  }
}

GroupParts PartsOf(const GraphGroup& group, const GraphMaps& maps) {
  GroupParts parts;
  for (const int map : group.maps) {
    parts[maps[map].solved_with].insert(map);
  }
  return parts;
}

void PlaceParts(const GraphGroup& group, const std::set<int>& fixed, const GroupParts& parts,
                const MapPairs& pairs, GraphMaps* maps) {
  const Merges merges = MergesOf(group, pairs);
  std::set<int> placed = fixed;
  while (placed.size() < group.maps.size()) {
    const Placed next = PlaceNext(merges, placed, *maps);
    const GraphMap& first = (*maps)[next.map];
    const Pose4 T_map_before = next.T_map_odom * first.T_map_odom.Inverse();
    for (const int number : parts.at(first.solved_with)) {
      (*maps)[number].Move(T_map_before);
      placed.insert(number);
    }
  }
}

}  // namespace pangea
