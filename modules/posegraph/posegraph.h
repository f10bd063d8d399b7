#pragma once

// The pose graph of all maps (the paper, section IV.D, "optimization of pose graph";
// docs/maths.md, sections 3 to 5): which maps are one, and where every keyframe is.
//
// In: keyframes of any maps, each map's in ascending seq, and verification results (constraints).
// Out: after each solve the corrections (T_map_odom of each map) and the group's state. A node is
// (x, y, z, yaw); roll and pitch are the odometry's. A map whose odometry does not know its scale
// well has that as one more state. Map frame: the odom of the group's map that was seen first.
//
// This class says what happens when; how is in its parts:
//   graph/         maps (nodes, odometry), loops, constraints that wait for keyframes
//   grouping/      pairs of maps and their merges, groups and when they are solved and published,
//                  where a group's maps lie before they are solved
//   optimization/  how a group is solved, its least-squares problem, how far its odometry drifts
//   solver/        poses of four degrees of freedom, robust least squares
//   publication/   refinements, and what is told of a group
//
// Deterministic: the same calls in the same order give the same bytes. When it solves depends on
// counts of messages, and on when it is told to update, alone. One thread.

#include <cstdint>
#include <vector>

#include "core/byte_record.h"
#include "core/keyframe.h"
#include "core/server_messages.h"
#include "posegraph/graph/graph_loops.h"
#include "posegraph/graph/graph_maps.h"
#include "posegraph/graph/received_constraints.h"
#include "posegraph/grouping/graph_groups.h"
#include "posegraph/grouping/map_pairs.h"
#include "posegraph/optimization/group_optimizer.h"
#include "posegraph/posegraph_options.h"
#include "posegraph/publication/group_publisher.h"

namespace pangea {

class PoseGraph {
 public:
  struct Counters {
    int64_t maps = 0;
    int64_t groups = 0;
    int64_t in_force = 0;
    int64_t switched_off = 0;  // by the robust solve
    int64_t unused = 0;        // evidence between maps that are not merged
    int64_t solves = 0;
    int64_t bridged = 0;        // composite edges
    int64_t waiting = 0;        // constraints, for their keyframes
    double odometry_scale = 1;  // largest of the groups, standard deviations
    int64_t not_metric = 0;     // maps whose scale is a state of the solve
  };

  // Revisions count from `first_revision`.
  explicit PoseGraph(const PoseGraphOptions& options, int64_t first_revision = 1);

  // What is added is looked at by the next Update.

  // The map has its place in the order of age from now on, keyframes or not.
  void AddMap(const MapId& map) { NumberOf(map); }
  // A repeat, or one older than the newest of its map, changes nothing.
  void AddKeyframe(const Keyframe& keyframe);
  // A repeat or a refusal changes nothing; one about an unknown keyframe waits for it
  // (graph/received_constraints.h says how many).
  void AddConstraint(const Constraint& constraint);
  // A group's state after bundle adjustment (publication/refinement.h). A repeat, an older one and
  // one about an unknown map change nothing.
  void AddRefinement(const MapState& refined);
  // The map's group is published again with the next update.
  void Republish(const MapId& map);

  // Solves what is due after all that was added, once, and publishes.
  PoseGraphUpdate Update();
  // Solves every group from the beginning, as if all had come at once, and publishes what is new.
  PoseGraphUpdate Finish();

  // All that was added but refinements, and its solution: solves first what is due, and publishes
  // nothing. Restored, it publishes as one that was given all that: false, and nothing has changed,
  // if these are not the bytes of a graph. Not for one that has published.
  void Save(ByteWriter* writer);
  bool Restore(ByteReader* reader);

  Counters counters() const;
  // Ids of the constraints that the last solves keep, ascending.
  std::vector<int64_t> InForce() const;
  // As the next state would say it.
  std::vector<MapState> States() const;

 private:
  int NumberOf(const MapId& map);
  // False when a keyframe of it is unknown.
  bool UseConstraint(const Constraint& constraint);
  GroupOptimizer Optimizer() { return {options_, pairs_, &maps_, &loops_}; }
  bool WholeIsDue(const GraphGroup& group) const;
  bool SolveIsDue(const GraphGroup& group, bool from_the_beginning) const;
  void SolveOnce(GraphGroup* group, bool from_the_beginning);
  // Until nothing is due.
  void SolveDue(bool from_the_beginning);
  // The first solve after a restart: what has joined a group since the checkpoint is solved beside
  // the group's solution.
  void SolveRestored();
  bool UndoMerges(const GraphGroup& group);
  bool IsUsed(const Loop& loop) const { return groups_.AreOne(loop.from.map, loop.to.map); }
  PoseGraphUpdate Publish(bool all_that_is_new);
  bool Read(ByteReader* reader);

  PoseGraphOptions options_;
  GraphMaps maps_;
  GraphLoops loops_;
  MapPairs pairs_;
  GraphGroups groups_;
  ReceivedConstraints constraints_;
  GroupPublisher publisher_;
  int64_t num_solves_ = 0;
  bool restored_ = false;  // until the first update after a restart
};

}  // namespace pangea
