// Edges and constraints of the maps after Thinning, and the pose graph's solution for them.

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "thinning/thinning.h"

namespace pangea {
namespace {

// Longer preintegrations are refused by the messages' parser, and carry little information.
constexpr double kMaxPreintegration_s = 60;

// Joins two successive edges: from the start of `first` to the end of `second`.
ThinnedMaps::Edge Join(const Keyframe& first, const ThinnedMaps::Edge& second) {
  ThinnedMaps::Edge joined;
  if (first.edge && second.edge) {
    const RelativePose whole = Compose({first.edge->T_from_this, first.edge->covariance},
                                       {second.edge->T_from_this, second.edge->covariance});
    joined.edge = {first.edge->from_seq, whole.T_from_to, whole.covariance};
  }
  if (joined.edge && first.preintegration && second.preintegration &&
      first.preintegration->duration_s + second.preintegration->duration_s < kMaxPreintegration_s) {
    joined.preintegration = pangea::Compose(*first.preintegration, *second.preintegration);
  }
  return joined;
}

}  // namespace

void Thinning::JoinEdges(ThinnedMaps* thinned) const {
  for (const auto& stored : stored_) {
    const MapId& id = stored.first;
    const auto& map = stored.second;
    for (auto it = map.keyframes.begin(); it != map.keyframes.end(); ++it) {
      const auto begins_at_one_that_goes = [&](const std::optional<OdometryEdge>& edge) {
        return edge && thinned->gone.contains({id, edge->from_seq});
      };
      if (thinned->gone.contains(it->id) || !begins_at_one_that_goes(it->edge)) {
        continue;
      }
      ThinnedMaps::Edge edge{it->edge, it->preintegration};
      for (auto before = it;
           before != map.keyframes.begin() && begins_at_one_that_goes(edge.edge);) {
        --before;
        if (before->id.seq == edge.edge->from_seq) {
          edge = Join(*before, edge);
        }
      }
      thinned->edges[it->id] = edge;
    }
  }
}

Thinning::Solution Thinning::Solve(const ThinnedMaps& without) const {
  PoseGraph graph(options_.posegraph);
  FillGraph(without, &graph);
  graph.Finish();
  Solution solution;
  solution.odometry_scale = graph.counters().odometry_scale;
  const std::vector<int64_t> in_force = graph.InForce();
  solution.in_force = {in_force.begin(), in_force.end()};
  for (const MapState& state : graph.States()) {
    if (state.keyframes.empty()) {
      continue;  // a map without remaining keyframes
    }
    for (const MapId& map : state.maps) {
      solution.group_of[map] = state.group;
      solution.log_scale[map] = graph.LogScale(map);
    }
    for (const KeyframePose& pose : state.keyframes) {
      solution.T_map_body[pose.id] = pose.T_map_body;
    }
  }
  return solution;
}

void Thinning::FillGraph(const ThinnedMaps& without, PoseGraph* graph) const {
  for (const MapId& map : maps_) {
    graph->AddMap(map);  // in order of age, even if none of its keyframes stays
  }
  for (const MapId& map : maps_) {
    for (const Keyframe& keyframe : stored_.at(map).keyframes) {
      if (without.gone.contains(keyframe.id)) {
        continue;
      }
      if (const auto edge = without.edges.find(keyframe.id); edge != without.edges.end()) {
        Keyframe joined = keyframe;
        joined.edge = edge->second.edge;
        graph->AddKeyframe(joined);
      } else {
        graph->AddKeyframe(keyframe);
      }
    }
  }
  for (const auto& [id, constraint] : constraints_) {
    if (!without.gone.contains(constraint.from) && !without.gone.contains(constraint.to) &&
        (constraint.kind != PlaceKind::kDerived || without.gone.empty())) {
      graph->AddConstraint(constraint);
    }
  }
  for (const Constraint& constraint : without.derived) {
    graph->AddConstraint(constraint);
  }
}

NodeRemoval Thinning::Removed(const Solution& solution, const std::set<KeyframeId>& gone) const {
  NodeRemoval graph;
  const double variance_scale = solution.odometry_scale * solution.odometry_scale;
  for (const auto& [id, map] : stored_) {
    for (const Keyframe& keyframe : map.keyframes) {
      if (keyframe.edge && solution.T_map_body.contains({id, keyframe.edge->from_seq})) {
        graph.AddOdometry({id, keyframe.edge->from_seq}, keyframe.id,
                          {keyframe.edge->T_from_this, variance_scale * keyframe.edge->covariance});
      }
    }
  }
  for (const auto& [id, constraint] : constraints_) {
    // A measured constraint whose keyframes both stay is unchanged.
    const bool changes = constraint.kind == PlaceKind::kDerived || gone.contains(constraint.from) ||
                         gone.contains(constraint.to);
    if (changes && solution.in_force.contains(id)) {
      graph.AddConstraint(constraint);
    }
  }
  std::set<KeyframeId> of_maps_that_go;
  for (const auto& [id, map] : stored_) {
    // If any keyframe of a map stays, the first one does
    if (gone.contains(map.keyframes.front().id)) {
      for (const Keyframe& keyframe : map.keyframes) {
        of_maps_that_go.insert(keyframe.id);
      }
      continue;
    }
    std::vector<KeyframeId> run;
    for (const Keyframe& keyframe : map.keyframes) {
      if (gone.contains(keyframe.id)) {
        run.push_back(keyframe.id);
      } else {
        graph.RemoveRun(std::exchange(run, {}));
      }
    }
    graph.RemoveRun(run);
  }
  graph.RemoveMaps(of_maps_that_go);
  return graph;
}

// Constraints between remaining keyframes, from the older map or keyframe to the newer one; the
// smallest covariance first. Their relative poses are those of the solution, which includes all
// measurements: so they never contradict each other. Those within a map are in the map's own units,
// as the pose graph expects them.
std::vector<Constraint> Thinning::BestKnownFirst(const Solution& solution,
                                                 const NodeRemoval& removed) const {
  std::map<MapId, size_t> age;
  for (const MapId& map : maps_) {
    age.emplace(map, age.size());
  }
  const auto rank = [&age](const KeyframeId& id) { return std::pair(age.at(id.map), id.seq); };
  std::vector<std::pair<double, Constraint>> constraints;
  for (const auto& [from, neighbours] : removed.factors()) {
    for (const auto& [to, factor] : neighbours) {
      if (factor.odometry || rank(to) < rank(from)) {
        continue;
      }
      Constraint constraint;
      constraint.from = from;
      constraint.to = to;
      constraint.kind = PlaceKind::kDerived;
      constraint.accepted = true;
      constraint.T_from_to = solution.T_map_body.at(from).Inverse() * solution.T_map_body.at(to);
      if (from.map == to.map) {
        constraint.T_from_to.t *= std::exp(-solution.log_scale.at(from.map));
      }
      constraint.covariance = factor.relative.covariance;
      constraint.num_inliers = factor.num_inliers;
      constraint.inlier_ratio = factor.inlier_ratio;
      constraint.rms_px = factor.rms_px;
      constraints.emplace_back(LogDeterminant(factor.relative), constraint);
    }
  }
  std::ranges::stable_sort(constraints, {}, &std::pair<double, Constraint>::first);
  std::vector<Constraint> sorted;
  sorted.reserve(constraints.size());
  for (auto& [log_determinant, constraint] : constraints) {
    sorted.push_back(std::move(constraint));
  }
  return sorted;
}

// Selects at most max_derived per keyframe. A constraint that joins maps which no more certain one
// has joined is always kept: a group must not split.
std::vector<Constraint> Thinning::Derive(const Solution& solution,
                                         const std::set<KeyframeId>& gone) const {
  std::map<MapId, MapId> joined;  // union-find: parent of each map; a root has none
  const auto find = [&joined](MapId map) {
    for (auto next = joined.find(map); next != joined.end(); next = joined.find(map)) {
      map = next->second;
    }
    return map;
  };
  std::map<KeyframeId, int> num_derived;
  std::vector<Constraint> derived;
  for (const Constraint& constraint : BestKnownFirst(solution, Removed(solution, gone))) {
    const MapId a = find(constraint.from.map), b = find(constraint.to.map);
    if (a == b && std::max(num_derived[constraint.from], num_derived[constraint.to]) >=
                      options_.thinning.max_derived) {
      continue;
    }
    if (a != b) {
      joined[a] = b;
    }
    ++num_derived[constraint.from];
    ++num_derived[constraint.to];
    derived.push_back(constraint);
  }
  return derived;
}

std::set<MapId> Thinning::ComeApart(const Solution& before, const ThinnedMaps& thinned) const {
  const Solution after = Solve(thinned);
  std::set<MapId> groups;  // the oldest map of each group is kept, and names the group
  for (const auto& [map, group] : after.group_of) {
    if (group != before.group_of.at(map)) {
      groups.insert(before.group_of.at(map));
    }
  }
  return groups;
}

}  // namespace pangea
