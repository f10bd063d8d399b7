// How one group is solved: where its maps start, which loops are doubted, how far its odometry is
// believed, and what becomes of the solution.

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "core/median.h"
#include "posegraph/posegraph.h"

namespace pangea {
namespace {

constexpr double kMeanChi2 = 4;  // chi-squared with four degrees of freedom
constexpr double kMaxVarianceFactor = 1e4;
constexpr size_t kMaxInnovations = 200;

double MedianDistance(const std::vector<PairEvidence::Innovation>& innovations, double factor) {
  std::vector<double> distances;
  for (const auto& [error, measurement, odometry] : innovations) {
    const Matrix4d covariance = measurement + factor * odometry;
    distances.push_back(error.dot(covariance.ldlt().solve(error)));
  }
  return Median(std::move(distances));
}

}  // namespace

bool PoseGraph::FitsOdometry(const Loop& loop) const {
  const OdometryChain& chain = maps_[loop.from.map].chain;
  const Eigen::Vector3d& p_to = chain[loop.to.node].T_odom_body.t;
  const Vector4d error =
      Residual({chain[loop.from.node].T_odom_body.t, 0}, {p_to, 0}, loop.relative);
  const Matrix4d covariance =
      loop.relative.covariance +
      BelievableDrift(chain, loop.from.node, loop.to.node, p_to, options_.merge);
  return error.dot(covariance.ldlt().solve(error)) <= options_.merge.agree_chi2;
}

std::vector<PairEvidence::Innovation> PoseGraph::Innovations(
    const Group& group, const std::vector<Loop*>& loops) const {
  std::vector<PairEvidence::Innovation> innovations;
  for (const Loop* loop : loops) {
    if (!loop->intra() || !FitsOdometry(*loop)) {
      continue;
    }
    const OdometryChain& chain = maps_[loop->from.map].chain;
    const Eigen::Vector3d& p_to = chain[loop->to.node].T_odom_body.t;
    innovations.push_back(
        {Residual({chain[loop->from.node].T_odom_body.t, 0}, {p_to, 0}, loop->relative),
         loop->relative.covariance, chain.DriftBetween(loop->from.node, loop->to.node, p_to)});
  }
  for (const PairEntry* entry : PairsOf(group)) {
    const auto& [pair, evidence] = *entry;
    if (evidence.decision().merge && group_of_[pair.first] == group_of_[pair.second]) {
      const auto more = evidence.Innovations();
      innovations.insert(innovations.end(), more.begin(), more.end());
    }
  }
  std::vector<PairEvidence::Innovation> some;
  const size_t stride = 1 + innovations.size() / kMaxInnovations;
  for (size_t i = 0; i < innovations.size(); i += stride) {
    some.push_back(innovations[i]);
  }
  return some;
}

double PoseGraph::OdometryVariance(const Group& group, const std::vector<Loop*>& loops) const {
  const auto innovations = Innovations(group, loops);
  // Loops at one place share one drift, so their median counts as a single sample: the likeliest
  // factor brings it to its mean. Nowhere a jump, which would let the shape hang on one constraint.
  if (innovations.empty() || MedianDistance(innovations, 1) < kMeanChi2) {
    return 1;
  }
  double low = 0, high = std::log(kMaxVarianceFactor);
  constexpr int kBisections = 20;
  for (int i = 0; i < kBisections; ++i) {
    const double middle = 0.5 * (low + high);
    (MedianDistance(innovations, std::exp(middle)) > kMeanChi2 ? low : high) = middle;
  }
  return std::exp(high);
}

PoseGraph::Placed PoseGraph::PlaceNext(const Group& group, const std::set<int>& placed) const {
  const PairEntry* best = nullptr;
  for (const PairEntry* entry : PairsOf(group)) {
    const Pair& pair = entry->first;
    const bool leads_on = placed.contains(pair.first) != placed.contains(pair.second) &&
                          group_of_[pair.first] == group_of_[pair.second];
    const auto rank = [this](const PairEntry& e) {
      return std::tuple(-e.second.decision().viewpoints, maps_[e.first.first].id,
                        maps_[e.first.second].id);
    };
    if (leads_on && IsMerged(*entry) && (best == nullptr || rank(*entry) < rank(*best))) {
      best = entry;
    }
  }
  const auto& [a, b] = best->first;
  const Pose4 T_a_b = best->second.Alignment();
  return placed.contains(a) ? Placed{b, maps_[a].T_map_odom * T_a_b}
                            : Placed{a, maps_[b].T_map_odom * T_a_b.Inverse()};
}

void PoseGraph::Place(const Group& group) {
  std::set<int> placed = {group.maps.front()};
  maps_[group.maps.front()].T_map_odom = {};
  while (placed.size() < group.maps.size()) {
    const Placed next = PlaceNext(group, placed);
    maps_[next.map].T_map_odom = next.T_map_odom;
    placed.insert(next.map);
  }
  for (const int number : group.maps) {
    MapChain& map = maps_[number];
    map.log_scale = 0;
    for (size_t i = 0; i < map.chain.size(); ++i) {
      map.poses[i] = map.PoseOf(static_cast<int>(i));
    }
    map.newest_solved = -1;
    map.covariance.setZero();
  }
}

void PoseGraph::ResetLoops(const Group& group, const std::vector<Loop*>& loops) {
  std::set<int64_t> agreeing;
  for (const PairEntry* entry : PairsOf(group)) {
    const std::vector<int64_t>& ids = entry->second.decision().agreeing;
    agreeing.insert(ids.begin(), ids.end());
  }
  for (Loop* loop : loops) {
    loop->on = loop->intra() ? FitsOdometry(*loop) : agreeing.contains(loop->id);
  }
}

void PoseGraph::Solve(Group* group, bool from_the_beginning) {
  ++num_solves_;
  const std::vector<Loop*> loops = LoopsOf(*group);
  const auto num_loops = static_cast<int64_t>(loops.size());
  const bool cold = group->regrouped || from_the_beginning;
  // Few loops are looked at anew each time, many when they have grown by a fifth.
  constexpr int kShare = 5;
  const bool graduated = cold || kShare * (num_loops - group->known_loops) >= num_loops;
  if (cold) {
    Place(*group);
  }
  if (graduated) {
    ResetLoops(*group, loops);
    group->odometry_variance = OdometryVariance(*group, loops);
  }
  const bool local =
      !graduated && NumKeyframes(*group) > static_cast<size_t>(options_.local_keyframes);
  const std::set<int> fixed = local ? FarMaps(*group, loops) : std::set<int>();
  group->stale = !cold;
  group->whole_loops = cold ? num_loops : group->whole_loops;
  NoteSolved(group);
  std::vector<Loop*> near;
  std::vector<bool> may_go;
  for (int64_t i = 0; i < num_loops; ++i) {
    if (!fixed.contains(loops[i]->from.map) || !fixed.contains(loops[i]->to.map)) {
      near.push_back(loops[i]);
      may_go.push_back(i >= group->known_loops);
    }
  }
  if (near.empty()) {
    return;
  }

  std::vector<SolvedMap> solved = SolvedMaps(*group, near);
  GroupSolver solver(options_.solver);
  AddMaps(*group, fixed, &solved, &solver);
  AddLoops(near, solved, &solver);
  if (graduated) {
    solver.SolveGraduated();
    group->known_loops = num_loops;
  } else {
    solver.SolveWarm(may_go);
  }
  Apply(solver, solved, fixed, near);
}

void PoseGraph::NoteSolved(Group* group) {
  for (const int map : group->maps) {
    solved_in_[map] = group->maps.front();
  }
  group->regrouped = false;
  group->waiting_loops = group->keyframes_waiting = 0;
  group->changed.clear();
  group->publish_now = group->unpublished = true;
}

std::set<int> PoseGraph::FarMaps(const Group& group, const std::vector<Loop*>& loops) const {
  std::set<int> near = group.changed;
  for (const Loop* loop : loops) {
    if (loop->on &&
        (group.changed.contains(loop->from.map) || group.changed.contains(loop->to.map))) {
      near.insert({loop->from.map, loop->to.map});
    }
  }
  std::set<int> far;
  std::ranges::set_difference(group.maps, near, std::inserter(far, far.end()));
  return far;
}

std::vector<PoseGraph::SolvedMap> PoseGraph::SolvedMaps(const Group& group,
                                                        const std::vector<Loop*>& loops) const {
  std::map<int, SolvedMap> by_number;
  for (const Loop* loop : loops) {
    for (const NodeRef& node : {loop->from, loop->to}) {
      SolvedMap& map =
          by_number.try_emplace(node.map, SolvedMap{node.map, node.node, node.node}).first->second;
      map.first = std::min(map.first, node.node);
      map.last = std::max(map.last, node.node);
    }
  }
  std::vector<SolvedMap> solved;
  int num_nodes = 0;
  for (auto& [number, map] : by_number) {
    if (options_.scope == PoseGraphOptions::Scope::kAll || number != group.maps.front()) {
      map.first = 0;
    }
    map.offset = num_nodes - map.first;
    num_nodes += map.last - map.first + 1;
    solved.push_back(map);
  }
  return solved;
}

void PoseGraph::AddMaps(const Group& group, const std::set<int>& fixed_maps,
                        std::vector<SolvedMap>* solved, GroupSolver* solver) const {
  for (SolvedMap& map : *solved) {
    const bool all_fixed = fixed_maps.contains(map.number);
    const double scale_sigma = maps_[map.number].chain.UnknownScale();
    if (scale_sigma > 0 && !all_fixed) {
      map.scale = solver->AddScale(maps_[map.number].log_scale, scale_sigma);
    }
    for (int i = map.first; i <= map.last; ++i) {
      const bool fixed = all_fixed || (map.number == group.maps.front() && i == map.first);
      solver->AddNode(maps_[map.number].poses[i], fixed);
    }
    if (all_fixed) {
      continue;
    }
    const OdometryChain& chain = maps_[map.number].chain;
    for (int i = map.first + 1; i <= map.last; ++i) {
      if (chain[i].edge_from >= map.first) {
        Relative4 edge = chain[i].edge;
        edge.covariance *= group.odometry_variance;
        solver->AddOdometry(map.offset + chain[i].edge_from, map.offset + i, edge, map.scale);
      }
    }
  }
}

void PoseGraph::AddLoops(const std::vector<Loop*>& loops, const std::vector<SolvedMap>& solved,
                         GroupSolver* solver) const {
  std::map<int, SolvedMap> by_number;
  for (const SolvedMap& map : solved) {
    by_number[map.number] = map;
  }
  for (const Loop* loop : loops) {
    const SolvedMap& from = by_number.at(loop->from.map);
    // Between maps, verification has weighed their scales.
    solver->AddLoop(from.offset + loop->from.node,
                    by_number.at(loop->to.map).offset + loop->to.node, loop->relative, loop->on,
                    loop->intra() ? from.scale : GroupSolver::kMetric);
  }
}

void PoseGraph::Apply(const GroupSolver& solver, std::vector<SolvedMap> solved,
                      const std::set<int>& fixed_maps, const std::vector<Loop*>& loops) {
  for (size_t i = 0; i < loops.size(); ++i) {
    loops[i]->on = solver.loop_on(static_cast<int>(i));
  }
  std::erase_if(solved, [&](const SolvedMap& map) { return fixed_maps.contains(map.number); });
  std::vector<int> newest;
  for (const SolvedMap& map : solved) {
    newest.push_back(map.offset + map.last);
  }
  const std::vector<Matrix4d> marginals = solver.Marginals(newest);
  for (size_t k = 0; k < solved.size(); ++k) {
    const auto& [number, first, last, offset, scale] = solved[k];
    MapChain& map = maps_[number];
    map.log_scale = scale == GroupSolver::kMetric ? 0 : solver.log_scale(scale);
    for (int i = first; i <= last; ++i) {
      map.poses[i] = solver.pose(offset + i);
    }
    const Pose4& newest_pose = map.poses[last];
    const Eigen::Vector3d arm = YawRotation(newest_pose.yaw) * map.chain[last].T_odom_body.t;
    map.T_map_odom = {newest_pose.p - map.scale() * arm, newest_pose.yaw};
    map.covariance = CovarianceAt(marginals[k], -arm);
    map.newest_solved = last;
    for (size_t i = last + 1; i < map.chain.size(); ++i) {
      map.poses[i] = map.PoseOf(static_cast<int>(i));
    }
  }
}

}  // namespace pangea
