#pragma once

// The refinements in use (refinement.h), and the published poses of a group's maps with them.

#include <map>
#include <vector>

#include "core/server_messages.h"
#include "posegraph/graph/graph_maps.h"
#include "posegraph/publication/refinement.h"

namespace pangea {

class Refinements {
 public:
  // False, and nothing changes, for a repeat, an older revision, or a refinement of no or an
  // unknown map.
  bool Add(const MapState& refined, const GraphMaps& maps);

  // The published poses of each of the group's maps, by map number. A map without a refinement
  // keeps its solved poses.
  std::map<int, RefinedMap> Refine(const std::vector<int>& group, const GraphMaps& maps) const;

 private:
  std::vector<Refinement> refinements_;  // no two share a map
};

}  // namespace pangea
