// The first answer after a restart: maps that joined a group since the checkpoint are solved alone,
// beside a solution that stays as it was. A large group takes long from the beginning, and that is
// still to be done then; but its agents know where they are.

#include <algorithm>
#include <utility>

#include "posegraph/posegraph.h"

namespace pangea {

void PoseGraph::JoinRestored() {
  if (restored_group_of_.empty()) {
    return;
  }
  const std::vector<int> restored_group_of = std::exchange(restored_group_of_, {});
  bool undone = false;
  for (auto& [oldest, group] : groups_) {
    if (group.regrouped && group.stale) {
      Join(&group, restored_group_of);
      undone |= UndoMerges(group);
    }
  }
  if (undone) {
    Regroup();
  }
}

// The oldest map's part of the group stays; a part that was solved by itself moves as one.
void PoseGraph::Join(Group* group, const std::vector<int>& restored_group_of) {
  std::map<int, std::set<int>> parts;
  const auto part_of = [&](int map) {
    return map < static_cast<int>(restored_group_of.size()) ? restored_group_of[map] : map;
  };
  for (const int map : group->maps) {
    parts[part_of(map)].insert(map);
  }
  const std::set<int> fixed = parts.at(part_of(group->maps.front()));
  std::set<int> placed = fixed;
  while (placed.size() < group->maps.size()) {
    const Placed next = PlaceNext(*group, placed);
    const Pose4 T_map_before = next.T_map_odom * maps_[next.map].T_map_odom.Inverse();
    for (const int number : parts.at(part_of(next.map))) {
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
  for (size_t i = 0; i < loops.size(); ++i) {
    loops[i]->on = solver.loop_on(static_cast<int>(i));
  }
  std::erase_if(solved, [&](const SolvedMap& map) { return fixed_maps.contains(map.number); });
  Apply(solver, solved);
  group->regrouped = false;
  group->waiting_loops = group->keyframes_waiting = 0;
  group->publish_now = group->unpublished = true;
}

}  // namespace pangea
