// The first answer after a restart, and when maps join a large group: they are solved alone, beside
// a solution that stays as it was. A large group takes long from the beginning, and that is still
// to be done then; but its agents know where they are.

#include <algorithm>
#include <utility>

#include "posegraph/posegraph.h"

namespace pangea {

void PoseGraph::JoinRestored() {
  if (!std::exchange(restored_, false)) {
    return;
  }
  bool undone = false;
  for (auto& [oldest, group] : groups_) {
    if (group.regrouped && group.stale) {
      Join(&group);
      undone |= UndoMerges(group);
    }
  }
  if (undone) {
    Regroup();
  }
}

PoseGraph::Parts PoseGraph::PartsOf(const Group& group) const {
  Parts parts;
  for (const int map : group.maps) {
    parts[solved_in_[map]].insert(map);
  }
  return parts;
}

bool PoseGraph::JoinsALargeOne(const Group& group) const {
  const Parts parts = PartsOf(group);
  size_t num_keyframes = 0;
  for (const int map : parts.at(solved_in_[group.maps.front()])) {
    num_keyframes += maps_[map].chain.size();
  }
  return parts.size() > 1 && num_keyframes > static_cast<size_t>(options_.local_keyframes);
}

// The oldest map's part of the group stays; a part that was solved by itself moves as one.
void PoseGraph::Join(Group* group) {
  const Parts parts = PartsOf(*group);
  const std::set<int>& fixed = parts.at(solved_in_[group->maps.front()]);
  std::set<int> placed = fixed;
  while (placed.size() < group->maps.size()) {
    const Placed next = PlaceNext(*group, placed);
    const Pose4 T_map_before = next.T_map_odom * maps_[next.map].T_map_odom.Inverse();
    for (const int number : parts.at(solved_in_[next.map])) {
      MapChain& map = maps_[number];
      map.T_map_odom = T_map_before * map.T_map_odom;
      for (Pose4& pose : map.poses) {
        pose = T_map_before * pose;
      }
      placed.insert(number);
    }
  }
  SolveJoined(group, fixed);
}

void PoseGraph::SolveJoined(Group* group, const std::set<int>& fixed_maps) {
  ++num_solves_;
  std::vector<Loop*> loops = LoopsOf(*group);
  group->odometry_variance = OdometryVariance(*group, loops);
  group->known_loops = static_cast<int64_t>(loops.size());
  std::erase_if(loops, [&](const Loop* loop) {
    return fixed_maps.contains(loop->from.map) && fixed_maps.contains(loop->to.map);
  });
  ResetLoops(*group, loops);
  std::vector<SolvedMap> solved = SolvedMaps(*group, loops);
  GroupSolver solver(options_.solver);
  AddMaps(*group, fixed_maps, &solved, &solver);
  AddLoops(loops, solved, &solver);
  solver.SolveGraduated();
  Apply(solver, solved, fixed_maps, loops);
  NoteSolved(group);
}

}  // namespace pangea
