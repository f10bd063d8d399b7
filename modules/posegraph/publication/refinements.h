#pragma once

// The refinements that are in use (refinement.h), and a group's maps as they are told with them.

#include <map>
#include <vector>

#include "core/server_messages.h"
#include "posegraph/graph/graph_maps.h"
#include "posegraph/publication/refinement.h"

namespace pangea {

class Refinements {
 public:
  // False when it changes nothing: a repeat, an older one, one about an unknown map.
  bool Add(const MapState& refined, const GraphMaps& maps);

  // Each of a group's maps, by number. Those that no refinement is about are as they are solved.
  std::map<int, RefinedMap> Refine(const std::vector<int>& group, const GraphMaps& maps) const;

 private:
  std::vector<Refinement> refinements_;  // no two share a map
};

}  // namespace pangea
