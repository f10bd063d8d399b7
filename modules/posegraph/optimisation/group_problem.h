#pragma once

// Builds the robust least-squares problem (group_solver.h) of a group's maps and loops, and writes
// its solution back into them.
//
// Input: a group's loops, its maps with their present poses, and the maps that stay fixed. Output:
// which loops are in force, and the poses of the other maps. The nodes of a map that are solved
// reach from the first node to the last one with a loop (in the paper's scope, the oldest map
// begins at its first node with a loop). Later nodes are appended by odometry alone.

#include <map>
#include <set>
#include <vector>

#include "posegraph/graph/graph_maps.h"
#include "posegraph/grouping/graph_group.h"
#include "posegraph/loop.h"
#include "posegraph/posegraph_options.h"
#include "posegraph/solver/group_solver.h"

namespace pangea {

class GroupProblem {
 public:
  // In a fixed map, all node poses and the scale stay.
  GroupProblem(const GraphGroup& group, std::vector<Loop*> loops, std::set<int> fixed_maps,
               const PoseGraphOptions& options, GraphMaps* maps);

  // Both solve (GroupSolver has the difference) and write the solution into maps and loops.
  void SolveGraduated();
  void SolveWarm(const std::vector<bool>& may_go);

 private:
  struct SolvedMap {
    int first = 0;
    int last = 0;
    int offset = 0;                    // node i of the map is node offset + i of the solver
    int scale = GroupSolver::kMetric;  // index of its scale state in the solver
  };

  void FindSolvedMaps(bool whole_oldest);
  void AddMaps();
  void AddOdometry(int number, const SolvedMap& solved);
  void AddLoops();
  void Apply();
  void ApplyTo(GraphMap* map, const SolvedMap& solved, const Matrix4d& marginal) const;

  int oldest_;
  double odometry_variance_;
  std::vector<Loop*> loops_;
  std::set<int> fixed_maps_;
  GraphMaps& maps_;
  std::map<int, SolvedMap> solved_;  // by map number
  GroupSolver solver_;
};

}  // namespace pangea
