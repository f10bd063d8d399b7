#pragma once

// The pose graph of all maps (the paper, section IV.D, "optimization of pose graph";
// docs/maths.md, sections 3 to 5): which maps are one, and where every keyframe is.
//
// In: keyframes of any maps, each map's in ascending seq, and verification results (constraints).
// Out: after each solve the corrections (T_map_odom of each map) and the group's state. A node is
// (x, y, z, yaw); roll and pitch are the odometry's. A map whose odometry does not know its scale
// well has that as one more state. Maps are grouped by the constraints in force:
// a pair is merged once several candidate alignments agree (pair_evidence.h), loops that contradict
// the rest are switched off by graduated non-convexity (group_solver.h), and a merge they no longer
// carry is undone. Map frame: the odom of the group's map that was seen first.
//
// Odometry that claims too much: weights come from covariances, but when the loops' innovations
// show that a group's odometry drifts more than it says, all its covariances are multiplied by one
// factor, the one that brings the median innovation to that of chi-squared (variance component
// estimation, robustly). Never below one.
//
// Deterministic: the same calls in the same order give the same bytes. When it solves depends on
// counts of messages, and on when it is told to settle, alone. One thread.

#include <cmath>
#include <cstdint>
#include <deque>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "core/byte_record.h"
#include "core/keyframe.h"
#include "core/server_messages.h"
#include "posegraph/loop.h"
#include "posegraph/odometry_chain.h"
#include "posegraph/pair_evidence.h"
#include "posegraph/refinement.h"
#include "posegraph/solver/group_solver.h"

namespace pangea {

struct PoseGraphOptions {
  enum class Scope {
    kAll,    // every keyframe of the group but one
    kPaper,  // the main map from its first overlap on; the other maps from their first keyframe
  };
  Scope scope = Scope::kAll;
  MergeOptions merge;
  GroupSolverOptions solver;
  // A group solves after each loop; a larger one waits for one more loop per so many keyframes,
  // or for so many new keyframes since the first waiting loop.
  int keyframes_per_waiting_loop = 300;
  int max_keyframes_waiting = 10;
  // Of a group with more keyframes than this a solve moves the maps that have new loops, and those
  // that share loops with them; all others stay, until the group's loops have grown by a tenth.
  int local_keyframes = 1000;
  // A group's state is published again after so many new keyframes, and 2 % of the group.
  int state_every = 10;

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.AddChoice("scope", &scope, {{"all", Scope::kAll}, {"paper", Scope::kPaper}},
                      "keyframes that are free: all but one, or as in the paper");
    archive.Add("keyframes_per_waiting_loop", &keyframes_per_waiting_loop, {1, 1000000}, "",
                "of a group: it waits for one more loop before it solves");
    archive.Add("max_keyframes_waiting", &max_keyframes_waiting, {0, 1000000}, "",
                "new keyframes for which loops wait at most");
    archive.Add("local_keyframes", &local_keyframes, {1, 100000000}, "",
                "of a group of which a solve moves only what is near new loops");
    archive.Add("state_every", &state_every, {1, 1000000}, "",
                "new keyframes, and 2 % of the group");
    archive.Section("merge", &merge, "when maps become one group");
    archive.Section("solver", &solver, "graduated non-convexity");
  }
};

struct PoseGraphUpdate {
  std::vector<Correction> corrections;
  std::vector<MapState> states;
};

class PoseGraph {
 public:
  struct Counters {
    int64_t maps = 0;
    int64_t groups = 0;
    int64_t in_force = 0;
    int64_t switched_off = 0;  // by the robust solve
    int64_t unused = 0;        // evidence between maps that are not merged
    int64_t solves = 0;
    int64_t bridged = 0;  // composite edges
    int64_t parked = 0;
    double odometry_scale = 1;  // largest of the groups, standard deviations
    int64_t not_metric = 0;     // maps whose scale is a state of the solve
  };

  // Revisions count from `first_revision`.
  explicit PoseGraph(const PoseGraphOptions& options, int64_t first_revision = 1);

  // A repeat, or one older than the newest of its map, changes nothing.
  void Take(const Keyframe& keyframe);
  // A repeat or a refusal changes nothing; one about an unknown keyframe waits for it (bounded:
  // beyond kMaxParked it is forgotten and may come again).
  void Take(const Constraint& constraint);
  // A group's state after bundle adjustment (refinement.h). A repeat, an older one and one about
  // an unknown map change nothing.
  void TakeRefined(const MapState& refined);
  // Solves what is due after all that was taken, once.
  PoseGraphUpdate Settle() { return Settle(false); }
  // Take and Settle.
  PoseGraphUpdate AddKeyframe(const Keyframe& keyframe);
  PoseGraphUpdate AddConstraint(const Constraint& constraint);
  // Solves every group from the beginning, as if all had come at once, and publishes what is new.
  PoseGraphUpdate Finish();

  // The map has its place in the order of age from now on, keyframes or not.
  void NoteMap(const MapId& map) { MapNumber(map); }

  // The map's group is published again with the next solve, or by Settle alone.
  void Republish(const MapId& map);

  // All that was taken but refinements, and its solution: solves first what is due, and publishes
  // nothing. Restored, it publishes as one that took all that: false, and nothing has changed, if
  // these are not the bytes of a graph. Not for one that has published.
  void Save(ByteWriter* writer);
  bool Restore(ByteReader* reader);

  Counters counters() const;
  // Ids of the constraints that the last solves keep, ascending.
  std::vector<int64_t> InForce() const;
  // As the next state would say it.
  std::vector<MapState> States() const;

 private:
  static constexpr size_t kMaxParked = 5000;

  struct MapChain {
    MapId id;
    OdometryChain chain;
    std::vector<Pose4> poses;     // of each node, in the map frame
    std::vector<int> loops_from;  // indices into loops_, of loops that begin in it
    Pose4 T_map_odom;
    double log_scale = 0;  // p_map = T_map_odom * (exp(log_scale) p_odom)
    int newest_solved = -1;
    Matrix4d covariance = Matrix4d::Zero();  // of T_map_odom
    bool corrected = false;                  // a correction was published

    double scale() const { return std::exp(log_scale); }
    // Where the newest solution has a node by odometry alone.
    Pose4 PoseOf(int node) const {
      return T_map_odom * Pose4{scale() * chain[node].T_odom_body.t, 0};
    }
    // The rigid transform that has the node, and what is near it, in its place.
    Pose4 RigidAt(int node) const {
      return {T_map_odom * Eigen::Vector3d((scale() - 1) * chain[node].T_odom_body.t),
              T_map_odom.yaw};
    }
  };
  struct Group {
    std::vector<int> maps;         // ascending: the first is the oldest
    bool regrouped = true;         // since the last solve
    bool stale = false;            // loops since the last solve from the beginning
    int waiting_loops = 0;         // since the last solve
    int keyframes_waiting = 0;     // since the first of them
    int64_t known_loops = 0;       // its loops that the last graduated solve saw
    int64_t whole_loops = 0;       // that the last solve from the beginning saw
    std::set<int> changed;         // maps with loops since the last solve
    double odometry_variance = 1;  // its factor
    bool unpublished = true;
    bool publish_now = false;
    int keyframes_unpublished = 0;
  };
  using Pair = std::pair<int, int>;
  using PairEntry = std::pair<const Pair, PairEvidence>;
  // What of a map is solved: from the first node to the last that has a loop; what comes after is
  // joined to the solution by odometry alone.
  struct SolvedMap {
    int number = 0;
    int first = 0;
    int last = 0;
    int offset = 0;                    // of its nodes in the solver, which counts from its own zero
    int scale = GroupSolver::kMetric;  // its state in the solver
  };

  int MapNumber(const MapId& map);
  void AddLoop(const Constraint& constraint, NodeRef from, NodeRef to);
  bool TryAdd(const Constraint& constraint);
  Group& GroupOf(int map) { return groups_.at(group_of_[map]); }
  // Both ends in the group; ascending.
  std::vector<int> LoopNumbersOf(const Group& group) const;
  std::vector<Loop*> LoopsOf(const Group& group);
  // Whose first map is in the group; ascending.
  std::vector<const PairEntry*> PairsOf(const Group& group) const;
  bool IsMerged(const PairEntry& pair) const {
    return pair.second.decision().merge && !undone_.contains(pair.first);
  }
  void Regroup();
  bool SolveIsDue(const Group& group) const;
  size_t NumKeyframes(const Group& group) const;
  // Whether the group is solved from the beginning once nothing more comes.
  bool WholeIsDue(const Group& group) const;
  // Solves what is due until nothing is.
  void SolveDue(bool from_the_beginning);
  // Then publishes.
  PoseGraphUpdate Settle(bool from_the_beginning);
  // Merges that their loops no longer carry; whether there were any.
  bool UndoMerges(const Group& group);

  // Of groups that maps have joined since they were solved, after a restart or when they are large:
  // the solution of the oldest map's part stays, the others are laid beside it; the next solve from
  // the beginning is due (posegraph_join.cc).
  void JoinRestored();
  using Parts = std::map<int, std::set<int>>;
  // Maps that were solved together, by what they were solved in.
  Parts PartsOf(const Group& group) const;
  bool JoinsALargeOne(const Group& group) const;
  void Join(Group* group);
  void SolveJoined(Group* group, const std::set<int>& fixed_maps);
  void NoteSolved(Group* group);

  void Solve(Group* group, bool from_the_beginning);
  struct Placed {
    int map = 0;
    Pose4 T_map_odom;
  };
  // Along the merges with most agreeing viewpoints: the next map of a group of which some are
  // placed.
  Placed PlaceNext(const Group& group, const std::set<int>& placed) const;
  void Place(const Group& group);
  // Maps that neither have new loops nor share loops in force with one that has.
  std::set<int> FarMaps(const Group& group, const std::vector<Loop*>& loops) const;
  void ResetLoops(const Group& group, const std::vector<Loop*>& loops);
  bool FitsOdometry(const Loop& loop) const;
  double OdometryVariance(const Group& group, const std::vector<Loop*>& loops) const;
  std::vector<PairEvidence::Innovation> Innovations(const Group& group,
                                                    const std::vector<Loop*>& loops) const;
  std::vector<SolvedMap> SolvedMaps(const Group& group, const std::vector<Loop*>& loops) const;
  // Of a fixed map every node stays where it is, and its scale.
  void AddMaps(const Group& group, const std::set<int>& fixed_maps, std::vector<SolvedMap>* solved,
               GroupSolver* solver) const;
  void AddLoops(const std::vector<Loop*>& loops, const std::vector<SolvedMap>& solved,
                GroupSolver* solver) const;
  // Which loops are in force, and where the maps are that were not fixed.
  void Apply(const GroupSolver& solver, std::vector<SolvedMap> solved,
             const std::set<int>& fixed_maps, const std::vector<Loop*>& loops);

  // Each of the group's maps as it is told.
  std::map<int, RefinedMap> RefinedMaps(const Group& group) const;
  MapState StateOf(const Group& group) const;
  void Publish(Group* group, PoseGraphUpdate* update);

  void SaveGroups(ByteWriter* writer) const;
  bool Read(ByteReader* reader);
  bool ReadPairs(ByteReader* reader);
  bool ReadGroups(ByteReader* reader);
  bool ReadSeen(ByteReader* reader);

  PoseGraphOptions options_;
  int64_t next_revision_;
  std::deque<MapChain> maps_;  // in the order they were first seen
  std::map<MapId, int> numbers_;
  std::deque<Loop> loops_;
  std::map<Pair, PairEvidence> pairs_;
  std::set<Pair> undone_;        // merges that the robust solve does not carry, until new evidence
  std::map<int, Group> groups_;  // by their oldest map
  std::vector<int> group_of_;    // of each map
  std::vector<int> solved_in_;   // of each map: the group's oldest when it was last solved
  bool restored_ = false;        // until the first settling after a restart
  std::vector<Constraint> parked_;
  std::set<int64_t> seen_;               // accepted constraints
  std::vector<Refinement> refinements_;  // no two share a map
  int64_t num_solves_ = 0;
};

}  // namespace pangea
