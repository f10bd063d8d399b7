#pragma once

// Solves one group. It chooses where the maps start, which loops the solve may reject, the factor
// on the odometry covariances, and which maps stay fixed. It has no state of its own: the results
// are written to maps, loops and group.

#include <set>
#include <vector>

#include "posegraph/graph/graph_loops.h"
#include "posegraph/graph/graph_maps.h"
#include "posegraph/grouping/graph_group.h"
#include "posegraph/grouping/map_pairs.h"
#include "posegraph/posegraph_options.h"

namespace pangea {

class GroupOptimiser {
 public:
  GroupOptimiser(const PoseGraphOptions& options, const MapPairs& pairs, GraphMaps* maps,
                 GraphLoops* loops)
      : options_(options), pairs_(pairs), maps_(*maps), loops_(*loops) {}

  // Solves from the beginning if asked to, or if the group's set of maps has changed.
  void Solve(GraphGroup* group, bool from_the_beginning) const;

  // Solves a group that other maps have joined: the solution of the oldest map's part stays fixed,
  // and the other maps are placed beside it and solved. This is quick, so the agents get
  // corrections early; the slow solve of the large group from the beginning stays due.
  void SolveJoined(GraphGroup* group) const;
  // Whether other maps have joined the oldest map's part, and that part is in its map frame.
  bool HasJoined(const GraphGroup& group) const;
  bool JoinsALargePart(const GraphGroup& group) const;

 private:
  // The maps that have no new loops and share no loop in force with a map that has.
  static std::set<int> FarMaps(const GraphGroup& group, const std::vector<Loop*>& loops);
  // Sets each loop in force if it agrees with the odometry (within a map) or with the merge
  // (between maps).
  void ResetLoops(const GraphGroup& group, const std::vector<Loop*>& loops) const;
  double OdometryVarianceOf(const GraphGroup& group, const std::vector<Loop*>& loops) const;
  void NoteSolved(GraphGroup* group) const;

  const PoseGraphOptions& options_;
  const MapPairs& pairs_;
  GraphMaps& maps_;
  GraphLoops& loops_;
};

}  // namespace pangea
