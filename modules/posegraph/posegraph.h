#pragma once

// The pose graph of all maps (the paper, section IV.D, "optimization of pose graph"; docs/maths.md,
// sections 3 to 5): which maps are merged into one group, and where every keyframe is.
//
// In: keyframes of any maps, each map's in ascending seq, and verification results (constraints).
// Out: after each solve the corrections (T_map_odom of each map) and the group's state. A node is
// (x, y, z, yaw); roll and pitch are those of the odometry. A map whose scale is not well observed
// has its scale as an additional state. The map frame is the odom frame of the group's oldest map.
//
// This class decides what happens and when; its parts do the work:
//   graph/         maps (nodes, odometry), loops, constraints whose keyframes are not here yet
//   grouping/      pairs of maps and their merges; groups, when to solve and publish them;
//                  initial placement of a group's maps
//   optimisation/  how a group is solved, its least-squares problem, its factor on odometry drift
//   solver/        poses of four degrees of freedom, robust least squares
//   publication/   refinements, and the published state of a group
//
// Deterministic: the same calls in the same order give the same bytes. When it solves depends only
// on counts of messages and on the calls of Update and Finish. One thread.

#include <cstdint>
#include <optional>
#include <set>
#include <vector>

#include "core/byte_record.h"
#include "core/keyframe.h"
#include "core/server_messages.h"
#include "posegraph/graph/graph_loops.h"
#include "posegraph/graph/graph_maps.h"
#include "posegraph/graph/received_constraints.h"
#include "posegraph/grouping/graph_groups.h"
#include "posegraph/grouping/map_pairs.h"
#include "posegraph/optimisation/group_optimiser.h"
#include "posegraph/posegraph_options.h"
#include "posegraph/publication/group_publisher.h"

namespace pangea {

class PoseGraph {
 public:
  struct Counters {
    int64_t maps = 0;
    int64_t groups = 0;
    int64_t in_force = 0;
    int64_t switched_off = 0;  // loops that the robust solve rejects
    int64_t unused = 0;        // loops between maps that are not in one group
    int64_t solves = 0;
    int64_t bridged = 0;        // composite edges (OdometryChain::Add)
    int64_t waiting = 0;        // constraints whose keyframes are not all here
    double odometry_scale = 1;  // largest factor on odometry sigmas, of all groups
    int64_t not_metric = 0;     // maps whose scale is a state of the solve
  };

  // The first published state has revision 1; each later one counts up by one. Live, it has the
  // wall clock's time at the start, or a higher one if keyframes name those of an earlier run: so
  // revisions increase across restarts, also if the clock went back.
  explicit PoseGraph(const PoseGraphOptions& options, std::optional<int64_t> start_utime = {});

  // Additions take effect with the next Update.

  // Fixes the map's place in the order of age, even if it has no keyframe yet.
  void AddMap(const MapId& map) { NumberOf(map); }
  // Ignores a repeat, and a keyframe older than the newest one of its map.
  void AddKeyframe(const Keyframe& keyframe);
  // Ignores a repeat and a refused constraint, unless tags contradict it: then its maps are
  // probably look-alikes. A constraint on an unknown keyframe waits for it
  // (graph/received_constraints.h says how many may wait).
  void AddConstraint(const Constraint& constraint);
  // Adds a group's state after bundle adjustment (publication/refinement.h). Ignores a repeat, an
  // older revision, and a state with an unknown map.
  void AddRefinement(const MapState& refined);
  // The next Update publishes the map's group again.
  void Republish(const MapId& map);

  // Solves every group for which a solve is due, and publishes the groups for which that is due.
  PoseGraphUpdate Update();
  // For the end, or a quiet bus: redoes merges that were undone, solves from the beginning each
  // group for which that is due, and publishes every group that has changed since it was published.
  PoseGraphUpdate Finish();

  // Saves everything added, except refinements, and the solution; it first solves what is due, and
  // publishes nothing. Restore is only for a graph that has published nothing yet; afterwards the
  // graph publishes as if it had been given everything itself. False if the bytes are not those of
  // a PoseGraph; then nothing has changed.
  void Save(ByteWriter* writer);
  bool Restore(ByteReader* reader);

  Counters counters() const;
  // The tags that seem to have been moved: the solve rejects constraints by them. They no longer
  // merge maps by themselves.
  std::set<TagId> MovedTags() const;
  // Ids of the constraints in force after the last solves, ascending.
  std::vector<int64_t> InForce() const;
  // One metre of the map's odometry is exp(LogScale) metres in the solution; 0 for a metric map.
  double LogScale(const MapId& map) const;
  // The states that would be published now, one per group.
  std::vector<MapState> States() const;

 private:
  int NumberOf(const MapId& map);
  void NoteDifferentTags(const Constraint& constraint);
  // False if one of its keyframes is unknown.
  bool UseConstraint(const Constraint& constraint);
  GroupOptimiser Optimiser() { return {options_, pairs_, &maps_, &loops_}; }
  bool WholeIsDue(const GraphGroup& group) const;
  bool SolveIsDue(const GraphGroup& group, bool from_the_beginning) const;
  void SolveOnce(GraphGroup* group, bool from_the_beginning);
  // Repeats until no solve is due.
  void SolveDue(bool from_the_beginning);
  // The first solve after a restart: maps that joined a group since the checkpoint are solved while
  // the group's restored solution stays fixed.
  void SolveRestored();
  bool UndoMerges(const GraphGroup& group);
  bool IsUsed(const Loop& loop) const { return groups_.AreOne(loop.from.map, loop.to.map); }
  void PassEarlierRevisions(const GraphMap& map);
  PoseGraphUpdate Publish(bool all_that_is_new);
  bool Read(ByteReader* reader);

  PoseGraphOptions options_;
  std::optional<int64_t> start_utime_;
  GraphMaps maps_;
  GraphLoops loops_;
  MapPairs pairs_;
  GraphGroups groups_;
  ReceivedConstraints constraints_;
  GroupPublisher publisher_;
  int64_t num_solves_ = 0;
  bool restored_ = false;  // from Restore to the first Update, if no merge is lost until then
};

}  // namespace pangea
