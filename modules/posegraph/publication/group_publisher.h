#pragma once

// Makes the published messages of a group: its state, with a new revision each time, and one
// correction per map. A map that is alone and was never corrected, by this run or an earlier one,
// gets no correction: its map frame is its odom.

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

  // False if the refinement is not used (Refinements::Add).
  bool AddRefinement(const MapState& refined, const GraphMaps& maps) {
    return refinements_.Add(refined, maps);
  }

  // The state that the next Publish would publish.
  MapState StateOf(const GraphGroup& group, const GraphMaps& maps, const GraphLoops& loops) const;
  // Appends the group's messages to `update`; appends nothing for a group without keyframes.
  void Publish(GraphGroup* group, const GraphMaps& maps, const GraphLoops& loops,
               PoseGraphUpdate* update);

  // An earlier run published this revision: the next ones are higher.
  void PassRevision(int64_t earlier);
  int64_t next_revision() const { return next_revision_; }

 private:
  MapState StateOf(const GraphGroup& group, const GraphMaps& maps, const GraphLoops& loops,
                   const std::map<int, RefinedMap>& told) const;

  int64_t next_revision_;
  Refinements refinements_;
  std::set<int> corrected_;  // maps for which a correction was published
};

}  // namespace pangea
