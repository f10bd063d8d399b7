#pragma once

// For tests of the pose graph: passes a synthetic world's keyframes and constraints to a graph, and
// measures the errors of the result.

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "core/testing/synthetic_world.h"
#include "posegraph/posegraph.h"

namespace pangea {

using Random = std::mt19937_64;

inline SyntheticWorldOptions PosesOnly(int num_agents, int num_keyframes, uint64_t seed = 1) {
  SyntheticWorldOptions options;
  options.seed = seed;
  options.num_agents = num_agents;
  options.num_keyframes = num_keyframes;
  options.with_corners = false;
  return options;
}

// Constraints for about `count` of the overlapping pairs, evenly chosen; a share of them is false.
inline std::vector<Constraint> MakeConstraints(const SyntheticWorld& world, int count,
                                               double false_share, uint64_t seed = 11) {
  Random random(seed);
  const std::vector<OverlappingPair> pairs = OverlappingPairs(world, 1.5, 25);
  std::vector<Constraint> constraints;
  const size_t stride = std::max<size_t>(1, pairs.size() / count);
  for (size_t i = 0; i < pairs.size(); i += stride) {
    const bool is_false = std::uniform_real_distribution<double>(0, 1)(random) < false_share;
    constraints.push_back((is_false ? MakeFalseConstraint : MakeTrueConstraint)(
        world, pairs[i].from, pairs[i].to, {}, random));
  }
  return constraints;
}

inline std::vector<Constraint> BetweenMaps(std::vector<Constraint> constraints) {
  std::erase_if(constraints, [](const Constraint& one) { return one.kind != PlaceKind::kInter; });
  return constraints;
}

// Adds one keyframe or constraint, then solves and publishes.
inline PoseGraphUpdate Add(const Keyframe& keyframe, PoseGraph* graph) {
  graph->AddKeyframe(keyframe);
  return graph->Update();
}

inline PoseGraphUpdate Add(const Constraint& constraint, PoseGraph* graph) {
  graph->AddConstraint(constraint);
  return graph->Update();
}

inline void AddKeyframes(const SyntheticWorld& world, PoseGraph* graph) {
  for (size_t k = 0; k < world.agents[0].keyframes.size(); ++k) {
    for (const SyntheticAgent& agent : world.agents) {
      Add(agent.keyframes[k], graph);
    }
  }
}

inline void AddConstraints(const std::vector<Constraint>& constraints, PoseGraph* graph) {
  for (const Constraint& constraint : constraints) {
    Add(constraint, graph);
  }
}

inline PoseGraphUpdate Solve(const SyntheticWorld& world,
                             const std::vector<Constraint>& constraints, PoseGraph* graph) {
  AddKeyframes(world, graph);
  AddConstraints(constraints, graph);
  return graph->Finish();
}

// Joint ATE of a group: RMSE of positions after the best rotation about z and shift, m.
inline double JointAte(const SyntheticWorld& world, const MapState& state) {
  Eigen::Vector3d mean_map = Eigen::Vector3d::Zero(), mean_hall = Eigen::Vector3d::Zero();
  const auto count = static_cast<double>(state.keyframes.size());
  for (const KeyframePose& pose : state.keyframes) {
    mean_map += pose.T_map_body.t / count;
    mean_hall += world.T_hall_body(pose.id).t / count;
  }
  double cross = 0, dot = 0;
  for (const KeyframePose& pose : state.keyframes) {
    const Eigen::Vector3d a = pose.T_map_body.t - mean_map;
    const Eigen::Vector3d b = world.T_hall_body(pose.id).t - mean_hall;
    cross += a.x() * b.y() - a.y() * b.x();
    dot += a.x() * b.x() + a.y() * b.y();
  }
  const Eigen::Quaterniond q = YawRotation(std::atan2(cross, dot));
  double sum = 0;
  for (const KeyframePose& pose : state.keyframes) {
    sum += (q * (pose.T_map_body.t - mean_map) - (world.T_hall_body(pose.id).t - mean_hall))
               .squaredNorm();
  }
  return std::sqrt(sum / count);
}

inline const Keyframe& NewestOf(const SyntheticWorld& world, const Correction& correction) {
  for (const SyntheticAgent& agent : world.agents) {
    if (agent.map == correction.map) {
      return agent.keyframes[correction.seq];
    }
  }
  return world.agents[0].keyframes[0];
}

// Error (x, y, z, yaw) of the correction's keyframe. The map frame is the odom of the first map,
// fixed at its first keyframe.
inline Vector4d ErrorOfNewest(const SyntheticWorld& world, const Correction& correction) {
  const Keyframe& first = world.agents[0].keyframes[0];
  const Keyframe& newest = NewestOf(world, correction);
  const double yaw_map_hall = YawOf(first.T_odom_body.q) - YawOf(world.agents[0].T_hall_body[0].q);
  const double yaw_odom_hall = YawOf(newest.T_odom_body.q) - YawOf(world.T_hall_body(newest.id).q);
  const Eigen::Vector3d p_map_body =
      first.T_odom_body.t + YawRotation(yaw_map_hall) *
                                (world.T_hall_body(newest.id).t - world.agents[0].T_hall_body[0].t);
  Vector4d error;
  error << correction.T_map_odom * newest.T_odom_body.t - p_map_body,
      WrapAngle(YawOf(correction.T_map_odom.q) - (yaw_map_hall - yaw_odom_hall));
  return error;
}

// Covariance of that error: of the pose of the keyframe, not of the origin of odom.
inline Matrix4d CovarianceOfNewest(const SyntheticWorld& world, const Correction& correction) {
  constexpr int kBlock[4] = {0, 1, 2, 5};
  const Matrix4d at_origin = correction.covariance(kBlock, kBlock);
  return CovarianceAt(at_origin,
                      correction.T_map_odom.q * NewestOf(world, correction).T_odom_body.t);
}

}  // namespace pangea
