#include "report/metrics/report_groups.h"

#include <algorithm>
#include <set>
#include <tuple>

namespace pangea {
namespace {

using Poses = std::map<KeyframeId, FinalKeyframe>;

// Adds the captured keyframes of `map` that are not solved, with T_map_odom = T_map_body *
// T_odom_body^-1 of their solved neighbour.
void CarryOn(const CapturedSession& session, const MapId& map, Poses* poses) {
  std::map<int32_t, Rigid3> T_map_odom;  // by seq of a keyframe both solved and captured
  for (auto solved = poses->lower_bound({map, 0});
       solved != poses->end() && solved->first.map == map; ++solved) {
    const auto captured = session.keyframes.find(solved->first);
    if (captured != session.keyframes.end()) {
      T_map_odom[solved->first.seq] =
          solved->second.T_map_body * captured->second.T_odom_body.Inverse();
    }
  }
  if (T_map_odom.empty()) {
    return;
  }
  for (auto it = session.keyframes.lower_bound({map, 0});
       it != session.keyframes.end() && it->first.map == map; ++it) {
    auto drift = T_map_odom.upper_bound(it->first.seq);
    drift = drift == T_map_odom.begin() ? drift : std::prev(drift);
    poses->try_emplace(it->first, FinalKeyframe{it->first, it->second.utime,
                                                drift->second * it->second.T_odom_body});
  }
}

std::vector<FinalKeyframe> Values(const Poses& poses) {
  std::vector<FinalKeyframe> values;
  for (const auto& [id, keyframe] : poses) {
    values.push_back(keyframe);
  }
  return values;
}

FinalGroup Solved(const CapturedSession& session, const MapState& state, std::vector<MapId> maps) {
  Poses poses;
  for (const KeyframePose& pose : state.keyframes) {
    if (std::ranges::binary_search(maps, pose.id.map)) {
      poses[pose.id] = {pose.id, pose.utime, pose.T_map_body};
    }
  }
  for (const MapId& map : maps) {
    CarryOn(session, map, &poses);
  }
  return {state.group, std::move(maps), Values(poses), state.num_switched_off};
}

FinalGroup Alone(const CapturedSession& session, const MapId& map) {
  Poses poses;
  for (auto it = session.keyframes.lower_bound({map, 0});
       it != session.keyframes.end() && it->first.map == map; ++it) {
    poses[it->first] = {it->first, it->second.utime, it->second.T_odom_body};
  }
  return {map, {map}, Values(poses), 0};
}

}  // namespace

std::vector<int32_t> FinalGroup::Agents() const {
  std::set<int32_t> agents;
  for (const MapId& map : maps) {
    agents.insert(map.agent_id);
  }
  return {agents.begin(), agents.end()};
}

size_t FinalGroup::CountOf(int32_t agent_id) const {
  return static_cast<size_t>(std::ranges::count(
      keyframes, agent_id, [](const FinalKeyframe& k) { return k.id.map.agent_id; }));
}

size_t FinalGroup::CountOf(const std::set<MapId>& maps) const {
  return static_cast<size_t>(std::ranges::count_if(
      keyframes, [&maps](const FinalKeyframe& k) { return maps.contains(k.id.map); }));
}

Trajectory FinalGroup::TrajectoryOf(const std::set<MapId>& maps) const {
  Trajectory trajectory;
  for (const FinalKeyframe& keyframe : keyframes) {
    if (maps.contains(keyframe.id.map)) {
      trajectory.push_back({keyframe.utime, keyframe.T_map_body});
    }
  }
  SortByTime(&trajectory);
  return trajectory;
}

std::vector<FinalGroup> FinalGroups(const CapturedSession& session) {
  std::map<std::pair<int64_t, MapId>, std::pair<const MapState*, std::vector<MapId>>> by_state;
  for (const auto& [map, state] : session.states) {
    auto& entry = by_state[{state->revision, state->group}];
    entry.first = state.get();
    entry.second.push_back(map);
  }
  std::vector<FinalGroup> groups;
  groups.reserve(by_state.size());
  for (const auto& [key, entry] : by_state) {
    groups.push_back(Solved(session, *entry.first, entry.second));
  }
  std::set<MapId> alone;
  for (const auto& [id, keyframe] : session.keyframes) {
    if (!session.states.contains(id.map)) {
      alone.insert(id.map);
    }
  }
  for (const MapId& map : alone) {
    groups.push_back(Alone(session, map));
  }
  std::ranges::sort(groups, [](const FinalGroup& a, const FinalGroup& b) {
    return std::tuple(b.Agents().size(), b.keyframes.size(), a.maps) <
           std::tuple(a.Agents().size(), a.keyframes.size(), b.maps);
  });
  return groups;
}

bool LacksStates(const CapturedSession& session) {
  return session.states.empty() &&
         std::ranges::any_of(session.constraints,
                             [](const auto& constraint) { return constraint.second.accepted; });
}

}  // namespace pangea
