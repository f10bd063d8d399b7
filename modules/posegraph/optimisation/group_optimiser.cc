#include "posegraph/optimisation/group_optimiser.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "posegraph/grouping/placement.h"
#include "posegraph/optimisation/group_problem.h"
#include "posegraph/optimisation/odometry_variance.h"

namespace pangea {

void GroupOptimiser::Solve(GraphGroup* group, bool from_the_beginning) const {
  SolveSchedule& schedule = group->solve;
  const std::vector<Loop*> loops = loops_.Among(group->maps);
  const auto num_loops = static_cast<int64_t>(loops.size());
  const bool cold = schedule.regrouped || from_the_beginning;
  // All loops are weighted anew when their number has grown by a fifth; a few loops, at every
  // solve.
  constexpr int kShare = 5;
  const bool graduated = cold || kShare * (num_loops - schedule.known_loops) >= num_loops;
  if (cold) {
    PlaceMaps(*group, pairs_, &maps_);
  }
  if (graduated) {
    ResetLoops(*group, loops);
    group->odometry_variance = OdometryVarianceOf(*group, loops);
  }
  const bool local =
      !graduated && maps_.NumKeyframes(group->maps) > static_cast<size_t>(options_.local_keyframes);
  const std::set<int> fixed = local ? FarMaps(*group, loops) : std::set<int>();
  schedule.stale = !cold;
  schedule.whole_loops = cold ? num_loops : schedule.whole_loops;
  NoteSolved(group);
  std::vector<Loop*> near;
  std::vector<bool> may_go;
  for (int64_t i = 0; i < num_loops; ++i) {
    if (!fixed.contains(loops[i]->from.map) || !fixed.contains(loops[i]->to.map)) {
      near.push_back(loops[i]);
      may_go.push_back(i >= schedule.known_loops);
    }
  }
  if (near.empty()) {
    return;
  }
  GroupProblem problem(*group, near, fixed, options_, &maps_);
  if (graduated) {
    problem.SolveGraduated();
    schedule.known_loops = num_loops;
  } else {
    problem.SolveWarm(may_go);
  }
}

bool GroupOptimiser::HasJoined(const GraphGroup& group) const {
  return maps_[group.oldest()].solved_with == group.oldest() && PartsOf(group, maps_).size() > 1;
}

bool GroupOptimiser::JoinsALargePart(const GraphGroup& group) const {
  return HasJoined(group) && maps_.NumKeyframes(PartsOf(group, maps_).at(group.oldest())) >
                                 static_cast<size_t>(options_.local_keyframes);
}

void GroupOptimiser::SolveJoined(GraphGroup* group) const {
  const GroupParts parts = PartsOf(*group, maps_);
  const std::set<int>& fixed = parts.at(maps_[group->oldest()].solved_with);
  PlaceParts(*group, fixed, parts, pairs_, &maps_);
  std::vector<Loop*> loops = loops_.Among(group->maps);
  group->odometry_variance = OdometryVarianceOf(*group, loops);
  group->solve.known_loops = static_cast<int64_t>(loops.size());
  std::erase_if(loops, [&](const Loop* loop) {
    return fixed.contains(loop->from.map) && fixed.contains(loop->to.map);
  });
  ResetLoops(*group, loops);
  GroupProblem(*group, loops, fixed, options_, &maps_).SolveGraduated();
  NoteSolved(group);
}

std::set<int> GroupOptimiser::FarMaps(const GraphGroup& group, const std::vector<Loop*>& loops) {
  const std::set<int>& changed = group.solve.changed;
  std::set<int> near = changed;
  for (const Loop* loop : loops) {
    if (loop->on && (changed.contains(loop->from.map) || changed.contains(loop->to.map))) {
      near.insert({loop->from.map, loop->to.map});
    }
  }
  std::set<int> far;
  std::ranges::set_difference(group.maps, near, std::inserter(far, far.end()));
  return far;
}

void GroupOptimiser::ResetLoops(const GraphGroup& group, const std::vector<Loop*>& loops) const {
  std::set<int64_t> agreeing;
  for (const MapPair* pair : pairs_.Among(group.maps)) {
    const std::vector<int64_t>& ids = pair->evidence.decision().agreeing;
    agreeing.insert(ids.begin(), ids.end());
  }
  for (Loop* loop : loops) {
    loop->on = loop->intra() ? FitsOdometry(*loop, maps_[loop->from.map].chain)
                             : agreeing.contains(loop->id);
  }
}

double GroupOptimiser::OdometryVarianceOf(const GraphGroup& group,
                                          const std::vector<Loop*>& loops) const {
  return OdometryVariance(
      Innovations({loops.begin(), loops.end()}, pairs_.Among(group.maps), maps_));
}

void GroupOptimiser::NoteSolved(GraphGroup* group) const {
  for (const int map : group->maps) {
    maps_[map].solved_with = group->oldest();
  }
  group->solve.Solved();
  group->publication.Request();
}

}  // namespace pangea
