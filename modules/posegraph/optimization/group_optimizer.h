#pragma once

// How one group is solved: where its maps start, which loops are doubted, how far its odometry is
// believed, which maps stay. It has no state of its own: what it finds is in maps, loops and group.

#include <set>
#include <vector>

#include "posegraph/graph/graph_loops.h"
#include "posegraph/graph/graph_maps.h"
#include "posegraph/grouping/graph_group.h"
#include "posegraph/grouping/map_pairs.h"
#include "posegraph/posegraph_options.h"

namespace pangea {

class GroupOptimizer {
 public:
  GroupOptimizer(const PoseGraphOptions& options, const MapPairs& pairs, GraphMaps* maps,
                 GraphLoops* loops)
      : options_(options), pairs_(pairs), maps_(*maps), loops_(*loops) {}

  // A group with other maps than before always from the beginning.
  void Solve(GraphGroup* group, bool from_the_beginning) const;

  // After maps have joined: the solution of the oldest map's part stays, the others are laid beside
  // it and solved. A large group takes long from the beginning, and that is still to be done then;
  // but its agents know where they are.
  void SolveJoined(GraphGroup* group) const;
  bool JoinsALargePart(const GraphGroup& group) const;

 private:
  // Maps that neither have new loops nor share loops in force with one that has.
  static std::set<int> FarMaps(const GraphGroup& group, const std::vector<Loop*>& loops);
  // In force is what the odometry, or the merge, agrees with.
  void ResetLoops(const GraphGroup& group, const std::vector<Loop*>& loops) const;
  double OdometryVarianceOf(const GraphGroup& group, const std::vector<Loop*>& loops) const;
  void NoteSolved(GraphGroup* group) const;

  const PoseGraphOptions& options_;
  const MapPairs& pairs_;
  GraphMaps& maps_;
  GraphLoops& loops_;
};

}  // namespace pangea
