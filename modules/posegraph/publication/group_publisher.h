#pragma once

// What the world is told of a group: its state, under a new revision each time, and a correction
// for each of its maps. A map that is alone and was never corrected is where its odometry says, and
// gets none.

#include <cstdint>
#include <map>
#include <set>
#include <vector>

#include "core/server_messages.h"
#include "posegraph/graph/graph_loops.h"
#include "posegraph/graph/graph_maps.h"
#include "posegraph/grouping/graph_group.h"
#include "posegraph/publication/refinements.h"

namespace pangea {

struct PoseGraphUpdate {
  std::vector<Correction> corrections;
  std::vector<MapState> states;
};

class GroupPublisher {
 public:
  explicit GroupPublisher(int64_t first_revision) : next_revision_(first_revision) {}

  // False when it changes nothing.
  bool AddRefinement(const MapState& refined, const GraphMaps& maps) {
    return refinements_.Add(refined, maps);
  }

  // As the next Publish would say it.
  MapState StateOf(const GraphGroup& group, const GraphMaps& maps, const GraphLoops& loops) const;
  // Nothing of a group without keyframes.
  void Publish(GraphGroup* group, const GraphMaps& maps, const GraphLoops& loops,
               PoseGraphUpdate* update);

  int64_t next_revision() const { return next_revision_; }

 private:
  MapState StateOf(const GraphGroup& group, const GraphMaps& maps, const GraphLoops& loops,
                   const std::map<int, RefinedMap>& told) const;

  int64_t next_revision_;
  Refinements refinements_;
  std::set<int> corrected_;  // maps of which a correction was published
};

}  // namespace pangea
