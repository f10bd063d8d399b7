#include "posegraph/optimisation/group_problem.h"

#include <algorithm>
#include <utility>

namespace pangea {

GroupProblem::GroupProblem(const GraphGroup& group, std::vector<Loop*> loops,
                           std::set<int> fixed_maps, const PoseGraphOptions& options,
                           GraphMaps* maps)
    : oldest_(group.oldest()),
      odometry_variance_(group.odometry_variance),
      loops_(std::move(loops)),
      fixed_maps_(std::move(fixed_maps)),
      maps_(*maps) {
  FindSolvedMaps(options.scope == PoseGraphOptions::Scope::kAll);
  AddMaps();
  AddLoops();
}

void GroupProblem::FindSolvedMaps(bool whole_oldest) {
  for (const Loop* loop : loops_) {
    for (const NodeRef& node : {loop->from, loop->to}) {
      SolvedMap& map = solved_.try_emplace(node.map, SolvedMap{node.node, node.node}).first->second;
      map.first = std::min(map.first, node.node);
      map.last = std::max(map.last, node.node);
    }
  }
  int num_nodes = 0;
  for (auto& [number, map] : solved_) {
    if (whole_oldest || number != oldest_) {
      map.first = 0;
    }
    map.offset = num_nodes - map.first;
    num_nodes += map.last - map.first + 1;
  }
}

void GroupProblem::AddMaps() {
  for (auto& [number, solved] : solved_) {
    const GraphMap& map = maps_[number];
    const bool all_fixed = fixed_maps_.contains(number);
    const double scale_sigma = map.chain.UnknownScale();
    if (scale_sigma > 0 && !all_fixed) {
      solved.scale = solver_.AddScale(map.log_scale, scale_sigma);
    }
    for (int i = solved.first; i <= solved.last; ++i) {
      const bool fixed = all_fixed || (number == oldest_ && i == solved.first);
      solver_.AddNode(map.poses[i], fixed);
    }
    if (!all_fixed) {
      AddOdometry(number, solved);
    }
  }
}

void GroupProblem::AddOdometry(int number, const SolvedMap& solved) {
  const OdometryChain& chain = maps_[number].chain;
  for (int i = solved.first + 1; i <= solved.last; ++i) {
    Relative4 edge = chain[i].edge;
    edge.covariance *= odometry_variance_;
    solver_.AddOdometry(solved.offset + i - 1, solved.offset + i, edge, solved.scale);
  }
}

void GroupProblem::AddLoops() {
  for (const Loop* loop : loops_) {
    const SolvedMap& from = solved_.at(loop->from.map);
    const SolvedMap& to = solved_.at(loop->to.map);
    // Loops between maps are metric: verification has accounted for the scales in their covariance.
    // So are those by a tag, whose size is known if the map is not metric (tag_alignment.h).
    solver_.AddLoop(from.offset + loop->from.node, to.offset + loop->to.node, loop->relative,
                    loop->on, loop->intra() && !loop->tag ? from.scale : GroupSolver::kMetric);
  }
}

void GroupProblem::SolveGraduated() {
  solver_.SolveGraduated();
  Apply();
}

void GroupProblem::SolveWarm(const std::vector<bool>& may_go) {
  solver_.SolveWarm(may_go);
  Apply();
}

void GroupProblem::Apply() {
  for (size_t i = 0; i < loops_.size(); ++i) {
    loops_[i]->on = solver_.loop_on(static_cast<int>(i));
  }
  std::vector<int> moved, newest;
  for (const auto& [number, solved] : solved_) {
    if (!fixed_maps_.contains(number)) {
      moved.push_back(number);
      newest.push_back(solved.offset + solved.last);
    }
  }
  const std::vector<Matrix4d> marginals = solver_.Marginals(newest);
  for (size_t k = 0; k < moved.size(); ++k) {
    ApplyTo(&maps_[moved[k]], solved_.at(moved[k]), marginals[k]);
  }
}

void GroupProblem::ApplyTo(GraphMap* map, const SolvedMap& solved, const Matrix4d& marginal) const {
  map->log_scale = solved.scale == GroupSolver::kMetric ? 0 : solver_.log_scale(solved.scale);
  for (int i = solved.first; i <= solved.last; ++i) {
    map->poses[i] = solver_.pose(solved.offset + i);
  }
  const Pose4& newest = map->poses[solved.last];
  const Eigen::Vector3d arm = YawRotation(newest.yaw) * map->chain[solved.last].T_odom_body.t;
  map->T_map_odom = {newest.p - map->scale() * arm, newest.yaw};
  map->covariance = CovarianceAt(marginal, -arm);
  map->newest_solved = solved.last;
  map->PlaceByOdometry(solved.last + 1);
}

}  // namespace pangea
