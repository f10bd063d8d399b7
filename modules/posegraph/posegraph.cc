#include "posegraph/posegraph.h"

#include <algorithm>

namespace pangea {
PoseGraph::PoseGraph(const PoseGraphOptions& options, int64_t first_revision)
    : options_(options), next_revision_(first_revision) {}

int PoseGraph::MapNumber(const MapId& id) {
  const auto [it, is_new] = numbers_.try_emplace(id, static_cast<int>(maps_.size()));
  if (is_new) {
    maps_.emplace_back().id = id;
    group_of_.push_back(it->second);
    solved_in_.push_back(it->second);
    Group group;
    group.maps = {it->second};
    groups_[it->second] = group;
  }
  return it->second;
}

void PoseGraph::Republish(const MapId& map) {
  if (const auto number = numbers_.find(map); number != numbers_.end()) {
    Group& group = GroupOf(number->second);
    group.unpublished = group.publish_now = true;
  }
}

PoseGraphUpdate PoseGraph::AddKeyframe(const Keyframe& keyframe) {
  Take(keyframe);
  return Settle();
}

PoseGraphUpdate PoseGraph::AddConstraint(const Constraint& constraint) {
  Take(constraint);
  return Settle();
}

void PoseGraph::Take(const Keyframe& keyframe) {
  const int number = MapNumber(keyframe.id.map);
  MapChain& map = maps_[number];
  if (!map.chain.Add(keyframe)) {
    return;
  }
  map.poses.push_back(map.PoseOf(static_cast<int>(map.chain.size()) - 1));
  Group& group = GroupOf(number);
  group.unpublished = true;
  ++group.keyframes_unpublished;
  group.keyframes_waiting += group.waiting_loops > 0 ? 1 : 0;
  if (group.keyframes_unpublished >=
      std::max<int>(options_.state_every, static_cast<int>(NumKeyframes(group) / 50))) {
    group.publish_now = true;
  }
  std::erase_if(parked_, [&](const Constraint& constraint) {
    return (constraint.from == keyframe.id || constraint.to == keyframe.id) && TryAdd(constraint);
  });
}

void PoseGraph::Take(const Constraint& constraint) {
  if (!constraint.accepted || seen_.contains(constraint.Id())) {
    return;
  }
  if (TryAdd(constraint)) {
    seen_.insert(constraint.Id());
  } else if (parked_.size() < kMaxParked) {
    seen_.insert(constraint.Id());
    parked_.push_back(constraint);
  }
}

bool PoseGraph::TryAdd(const Constraint& constraint) {
  const auto find = [this](const KeyframeId& id) -> std::optional<NodeRef> {
    const auto map = numbers_.find(id.map);
    if (map == numbers_.end()) {
      return std::nullopt;
    }
    const std::optional<int> node = maps_[map->second].chain.Find(id.seq);
    return node ? std::optional<NodeRef>({map->second, *node}) : std::nullopt;
  };
  const auto from = find(constraint.from);
  const auto to = find(constraint.to);
  if (from && to) {
    AddLoop(constraint, *from, *to);
  }
  return from && to;
}

void PoseGraph::AddLoop(const Constraint& constraint, NodeRef from, NodeRef to) {
  const OdometryChain::Node& node_from = maps_[from.map].chain[from.node];
  const OdometryChain::Node& node_to = maps_[to.map].chain[to.node];
  Loop loop;
  loop.id = constraint.Id();
  loop.from = from;
  loop.to = to;
  loop.num_inliers = constraint.num_inliers;
  loop.derived = constraint.kind == PlaceKind::kDerived;
  loop.relative =
      MakeRelative4(constraint.T_from_to, constraint.covariance, node_from.T_odom_body.q,
                    node_from.roll_pitch_covariance, node_to.T_odom_body.q);
  maps_[from.map].loops_from.push_back(static_cast<int>(loops_.size()));
  loops_.push_back(loop);
  if (!loop.intra()) {
    const bool forward = maps_[from.map].id < maps_[to.map].id;
    const Pair pair = forward ? Pair(from.map, to.map) : Pair(to.map, from.map);
    const auto it =
        pairs_.try_emplace(pair, maps_[pair.first].chain, maps_[pair.second].chain, options_.merge)
            .first;
    const bool merged = IsMerged(*it);
    it->second.Add({.id = loop.id,
                    .node_a = forward ? from.node : to.node,
                    .node_b = forward ? to.node : from.node,
                    .relative = forward ? loop.relative : loop.relative.Inverse(),
                    .num_inliers = loop.num_inliers,
                    .derived = loop.derived});
    undone_.erase(pair);
    if (IsMerged(*it) != merged) {
      Regroup();
    }
  }
  if (group_of_[from.map] == group_of_[to.map]) {
    Group& group = GroupOf(from.map);
    ++group.waiting_loops;
    group.changed.insert({from.map, to.map});
    group.stale = true;
  }
}

bool PoseGraph::SolveIsDue(const Group& group) const {
  const int enough =
      1 + static_cast<int>(NumKeyframes(group)) / options_.keyframes_per_waiting_loop;
  return group.waiting_loops >= enough ||
         (group.waiting_loops > 0 && group.keyframes_waiting >= options_.max_keyframes_waiting);
}

bool PoseGraph::WholeIsDue(const Group& group) const {
  constexpr int64_t kShare = 10;
  if (!group.stale || NumKeyframes(group) <= static_cast<size_t>(options_.local_keyframes)) {
    return group.stale;
  }
  const auto num_loops = static_cast<int64_t>(LoopNumbersOf(group).size());
  return kShare * (num_loops - group.whole_loops) >= num_loops;
}

void PoseGraph::SolveDue(bool from_the_beginning) {
  const auto due = [&](const auto& entry) {
    const Group& group = entry.second;
    return (group.regrouped && group.stale) || SolveIsDue(group) ||
           (from_the_beginning && (group.waiting_loops > 0 || WholeIsDue(group)));
  };
  for (auto it = std::ranges::find_if(groups_, due); it != groups_.end();
       it = std::ranges::find_if(groups_, due)) {
    Group& group = it->second;
    const bool whole = from_the_beginning && WholeIsDue(group);
    if (!whole && group.regrouped && JoinsALargeOne(group)) {
      Join(&group);
    } else {
      Solve(&group, whole);
    }
    if (UndoMerges(group)) {
      Regroup();
    }
  }
}

PoseGraphUpdate PoseGraph::Settle(bool from_the_beginning) {
  if (!from_the_beginning) {
    JoinRestored();
  }
  SolveDue(from_the_beginning);
  PoseGraphUpdate update;
  for (auto& [oldest, group] : groups_) {
    if (group.publish_now || (from_the_beginning && group.unpublished)) {
      Publish(&group, &update);
    }
  }
  return update;
}

PoseGraphUpdate PoseGraph::Finish() {
  if (std::ranges::any_of(groups_, [](const auto& entry) { return entry.second.stale; })) {
    undone_.clear();
    Regroup();
  }
  return Settle(true);
}

void PoseGraph::TakeRefined(const MapState& refined) {
  const Refinement refinement(refined);
  const auto known = [this](const MapId& map) { return numbers_.contains(map); };
  const auto shares = [&](const Refinement& held) { return held.SharesMapWith(refinement); };
  const auto as_new = [&](const Refinement& held) {
    return shares(held) && held.revision() >= refinement.revision();
  };
  if (!std::ranges::all_of(refinement.maps(), known) || std::ranges::any_of(refinements_, as_new)) {
    return;
  }
  std::erase_if(refinements_, shares);
  refinements_.push_back(refinement);
  for (const MapId& map : refinement.maps()) {
    Group& group = GroupOf(numbers_.at(map));
    group.unpublished = group.publish_now = true;
  }
}

std::map<int, RefinedMap> PoseGraph::RefinedMaps(const Group& group) const {
  std::map<int, RefinedMap> maps;
  for (const int number : group.maps) {
    maps.try_emplace(number, maps_[number].chain, maps_[number].poses);
  }
  for (const Refinement& refinement : refinements_) {
    const auto here = [&](const MapId& map) { return maps.contains(numbers_.at(map)); };
    if (!std::ranges::all_of(refinement.maps(), here)) {
      continue;
    }
    std::vector<std::pair<NodeRef, Rigid3>> nodes;
    std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> positions;
    for (const auto& [id, pose] : refinement.poses()) {
      const int number = numbers_.at(id.map);
      if (const std::optional<int> node = maps_[number].chain.Find(id.seq)) {
        nodes.emplace_back(NodeRef{number, *node}, pose);
        positions.emplace_back(maps_[number].poses[*node].p, pose.t);
      }
    }
    if (nodes.empty()) {
      continue;
    }
    const Rigid3 T_map_refined = FitYawAndShift(positions).ToRigid3();
    for (const auto& [node, pose] : nodes) {
      maps.at(node.map).Add(node.node, T_map_refined * pose);
    }
  }
  return maps;
}

MapState PoseGraph::StateOf(const Group& group) const {
  const std::map<int, RefinedMap> told = RefinedMaps(group);
  MapState state;
  state.group = maps_[group.maps.front()].id;
  state.revision = next_revision_;
  for (const int number : group.maps) {
    const MapChain& map = maps_[number];
    state.maps.push_back(map.id);
    for (size_t i = 0; i < map.chain.size(); ++i) {
      const OdometryChain::Node& node = map.chain[i];
      state.keyframes.push_back(
          {{map.id, node.seq}, node.utime, told.at(number).T_map_body(static_cast<int>(i))});
    }
  }
  for (const int loop : LoopNumbersOf(group)) {
    ++(loops_[loop].on ? state.num_constraints : state.num_switched_off);
  }
  return state;
}

void PoseGraph::Publish(Group* group, PoseGraphUpdate* update) {
  group->unpublished = group->publish_now = false;
  group->keyframes_unpublished = 0;
  const MapState state = StateOf(*group);
  if (state.keyframes.empty()) {
    return;
  }
  ++next_revision_;
  const std::map<int, RefinedMap> told = RefinedMaps(*group);
  for (const int number : group->maps) {
    MapChain& map = maps_[number];
    // Alone and never corrected, a map is where its odometry says.
    if (map.newest_solved < 0 && !map.corrected) {
      continue;
    }
    map.corrected = true;
    Correction correction;
    correction.map = map.id;
    const int newest = std::max(map.newest_solved, 0);
    const OdometryChain::Node& node = map.chain[newest];
    correction.seq = node.seq;
    correction.group = state.group;
    correction.revision = state.revision;
    correction.T_map_odom = (told.at(number).Shift(newest) * map.RigidAt(newest)).ToRigid3();
    constexpr double kLeastVariance = 1e-12;
    correction.covariance = kLeastVariance * Matrix6d::Identity();
    correction.covariance.topLeftCorner<3, 3>() += map.covariance.topLeftCorner<3, 3>();
    correction.covariance.block<3, 1>(0, 5) += map.covariance.topRightCorner<3, 1>();
    correction.covariance.block<1, 3>(5, 0) += map.covariance.bottomLeftCorner<1, 3>();
    correction.covariance(5, 5) += map.covariance(3, 3);
    correction.covariance.block<2, 2>(3, 3) += node.roll_pitch_covariance;
    update->corrections.push_back(correction);
  }
  update->states.push_back(state);
}

std::vector<MapState> PoseGraph::States() const {
  std::vector<MapState> states;
  for (const auto& [oldest, group] : groups_) {
    states.push_back(StateOf(group));
  }
  return states;
}

std::vector<int64_t> PoseGraph::InForce() const {
  std::vector<int64_t> ids;
  for (const Loop& loop : loops_) {
    if (loop.on && group_of_[loop.from.map] == group_of_[loop.to.map]) {
      ids.push_back(loop.id);
    }
  }
  std::ranges::sort(ids);
  return ids;
}

PoseGraph::Counters PoseGraph::counters() const {
  Counters counters;
  counters.maps = static_cast<int64_t>(maps_.size());
  counters.groups = static_cast<int64_t>(groups_.size());
  for (const Loop& loop : loops_) {
    const bool used = group_of_[loop.from.map] == group_of_[loop.to.map];
    ++(!used ? counters.unused : loop.on ? counters.in_force : counters.switched_off);
  }
  counters.solves = num_solves_;
  for (const MapChain& map : maps_) {
    counters.bridged += map.chain.num_bridged();
  }
  counters.not_metric = std::ranges::count_if(
      maps_, [](const MapChain& map) { return map.chain.UnknownScale() > 0; });
  counters.parked = static_cast<int64_t>(parked_.size());
  for (const auto& [oldest, group] : groups_) {
    counters.odometry_scale = std::max(counters.odometry_scale, std::sqrt(group.odometry_variance));
  }
  return counters;
}

}  // namespace pangea
