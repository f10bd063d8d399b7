#pragma once

// A group's maps and loops as the robust least-squares problem (group_solver.h), and its solution
// back into them.
//
// In: a group's loops, its maps as they lie now, and the maps that stay. Out: which of the loops
// are in force, and where the other maps are. Of a map is solved: from the first node (of the
// oldest map in the paper's scope: from the first with a loop) to the last with a loop; what comes
// after is joined to the solution by odometry alone.

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
  // Of a fixed map every node stays where it is, and its scale.
  GroupProblem(const GraphGroup& group, std::vector<Loop*> loops, std::set<int> fixed_maps,
               const PoseGraphOptions& options, GraphMaps* maps);

  // From the beginning, or from the maps as they lie (GroupSolver says more). Then the solution is
  // in maps and loops.
  void SolveGraduated();
  void SolveWarm(const std::vector<bool>& may_go);

 private:
  struct SolvedMap {
    int first = 0;
    int last = 0;
    int offset = 0;                    // of its nodes in the solver, which counts from its own zero
    int scale = GroupSolver::kMetric;  // its state in the solver
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
  std::map<int, SolvedMap> solved_;  // by number
  GroupSolver solver_;
};

}  // namespace pangea
