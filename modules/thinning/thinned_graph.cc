// Edges and constraints of the maps that Thinning leaves, and what the pose graph says of them.

#include <algorithm>
#include <optional>
#include <tuple>
#include <utility>

#include "thinning/thinning.h"

namespace pangea {
namespace {

// Longer preintegrations are refused by the messages' parser, and hold nothing together.
constexpr double kMaxPreintegration_s = 60;

// From the keyframe that `first` begins at to that of `second`.
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
  for (const auto& [id, map] : stored_) {
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
  for (const MapId& map : maps_) {
    graph.NoteMap(map);  // the oldest first, also where none of its keyframes stays
  }
  for (const MapId& map : maps_) {
    for (const Keyframe& keyframe : stored_.at(map).keyframes) {
      if (without.gone.contains(keyframe.id)) {
        continue;
      }
      if (const auto edge = without.edges.find(keyframe.id); edge != without.edges.end()) {
        Keyframe joined = keyframe;
        joined.edge = edge->second.edge;
        graph.Take(joined);
      } else {
        graph.Take(keyframe);
      }
    }
  }
  for (const auto& [id, constraint] : constraints_) {
    if (!without.gone.contains(constraint.from) && !without.gone.contains(constraint.to) &&
        !without.derived.contains(id) && !without.constraints_gone.contains(id)) {
      graph.Take(constraint);
    }
  }
  for (const auto& [id, constraint] : without.derived) {
    graph.Take(constraint);
  }
  graph.Finish();
  Solution solution;
  solution.odometry_scale = graph.counters().odometry_scale;
  const std::vector<int64_t> in_force = graph.InForce();
  solution.in_force = {in_force.begin(), in_force.end()};
  for (const MapState& state : graph.States()) {
    for (const MapId& map : state.maps) {
      solution.group_of[map] = state.group;
    }
    for (const KeyframePose& pose : state.keyframes) {
      solution.T_map_body[pose.id] = pose.T_map_body;
    }
  }
  return solution;
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
  std::set<std::pair<KeyframeId, KeyframeId>> added;
  for (const auto& [id, constraint] : constraints_) {
    if (solution.in_force.contains(id) &&
        added.insert(std::minmax(constraint.from, constraint.to)).second) {
      graph.AddConstraint(constraint);
    }
  }
  std::set<KeyframeId> of_maps_that_go;
  for (const auto& [id, map] : stored_) {
    if (gone.contains(map.keyframes.front().id)) {  // the first stays where any stays
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

void Thinning::Derive(const Solution& solution, const std::set<MapId>& all_derived,
                      ThinnedMaps* thinned) const {
  using Pair = std::pair<KeyframeId, KeyframeId>;
  // Measured ones, by their keyframes: of these each stays, whatever is averaged with it.
  std::map<Pair, int64_t> measured;
  for (const auto& [id, constraint] : constraints_) {
    if (!thinned->gone.contains(constraint.from) && !thinned->gone.contains(constraint.to)) {
      if (candidates_.contains(id)) {
        measured.emplace(Pair(constraint.from, constraint.to), id);
      } else {
        thinned->constraints_gone.insert(id);  // an earlier thinning's, derived anew
      }
    }
  }
  std::map<MapId, size_t> age;
  for (const MapId& map : maps_) {
    age.emplace(map, age.size());
  }
  const auto older = [&age](const KeyframeId& a, const KeyframeId& b) {
    return std::pair(age.at(a.map), a.seq) < std::pair(age.at(b.map), b.seq);
  };
  std::vector<std::pair<double, Constraint>> new_ones;  // by how well they are known
  const NodeRemoval removed = Removed(solution, thinned->gone);
  for (const auto& [from, neighbours] : removed.factors()) {
    for (const auto& [to, factor] : neighbours) {
      Constraint constraint;
      constraint.from = from;
      constraint.to = to;
      constraint.kind = from.map == to.map ? PlaceKind::kIntra : PlaceKind::kInter;
      constraint.accepted = true;
      constraint.T_from_to = factor.relative.T_from_to;
      constraint.covariance = factor.relative.covariance;
      constraint.num_inliers = factor.num_inliers;
      constraint.inlier_ratio = factor.inlier_ratio;
      constraint.rms_px = factor.rms_px;
      const auto real = measured.find({from, to});
      if (factor.odometry || (real == measured.end() && !older(from, to))) {
        continue;
      }
      if (real != measured.end()) {
        const Constraint& was = constraints_.at(real->second);
        if (factor.derived && was.accepted) {
          constraint.kind = was.kind;
          thinned->derived[real->second] = constraint;
        }
      } else if (!measured.contains({to, from})) {
        new_ones.emplace_back(LogDeterminant(factor.relative), constraint);
      }
    }
  }
  std::ranges::stable_sort(new_ones, {}, &std::pair<double, Constraint>::first);
  std::map<KeyframeId, int> num_derived;
  for (const auto& [known, constraint] : new_ones) {
    if (all_derived.contains(constraint.from.map) || all_derived.contains(constraint.to.map) ||
        std::max(num_derived[constraint.from], num_derived[constraint.to]) <
            options_.thinning.max_derived) {
      ++num_derived[constraint.from];
      ++num_derived[constraint.to];
      thinned->derived[constraint.Id()] = constraint;
      thinned->constraints_gone.erase(constraint.Id());
    }
  }
}

std::set<MapId> Thinning::ComeApart(const Solution& before, const ThinnedMaps& thinned) const {
  const Solution after = Solve(thinned);
  std::set<MapId> apart;  // the oldest map of each group is whole: it names the group
  for (const auto& [map, group] : after.group_of) {
    if (group != before.group_of.at(map)) {
      apart.insert(map);
    }
  }
  return apart;
}

}  // namespace pangea
