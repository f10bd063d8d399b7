#pragma once

// A whole world for tests, from one options struct: a hall of points with descriptors, agents that
// walk through it on overlapping rounds, the complete keyframes that their odometry would send, and
// the ground truth. The noise agrees with the keyframes' covariances. The same options, with their
// seed, give the same world.
//
// Frames: `hall` is the gravity-aligned frame of the ground truth. The odom frame of each agent has
// a random yaw and origin relative to it, and drifts.

#include <cstdint>
#include <random>
#include <vector>

#include "core/keyframe.h"
#include "core/server_messages.h"

namespace pangea {

struct SyntheticPoint {
  Eigen::Vector3d p_hall;  // metres
  Descriptor descriptor;
};

struct SyntheticWorldOptions {
  uint64_t seed = 1;
  // The hall: points on its walls, floor and on boxes standing in it.
  int num_points = 3000;
  double length_m = 24, width_m = 16, height_m = 5;
  // Objects that look the same in every world with the same object_seed. Each world puts them at
  // other places.
  int num_objects = 0;
  int points_per_object = 40;
  uint64_t object_seed = 7;

  int num_agents = 2;
  int num_keyframes = 60;  // of each agent
  double step_m = 0.4;     // distance between two keyframes
  // Agents start this share of a round apart.
  double start_apart = 0.1;
  int64_t opened_utime = 1000;  // of the first agent's map; each next agent's is one more

  // False: keyframes without corners and points, which is quick when only poses are needed.
  bool with_corners = true;
  double pixel_sigma = 1.0;  // at octave 0
  double flip_probability = 0.07;
  double detect_probability = 0.75;
  double tracked_share = 0.35;  // share of the points that are tracked landmarks
  int clutter = 60;             // corners per keyframe that are in no other keyframe
  double relative_depth_sigma = 0.03;

  // Standard deviations of the drift of each edge (metres, radians), and of the tilt error.
  double edge_sigma_m = 0.004;
  double edge_sigma_yaw = 0.0006;
  double tilt_sigma = 0.001;       // roll and pitch: bounded by gravity
  double claimed_sigma_scale = 1;  // claimed / true standard deviation; below 1: overconfident
};

struct SyntheticAgent {
  MapId map;
  std::vector<Keyframe> keyframes;
  std::vector<Rigid3> T_hall_body;
  // For each corner of each keyframe, the index of its point in SyntheticWorld; -1 for clutter.
  std::vector<std::vector<int>> point_of_corner;
};

struct SyntheticWorld {
  std::vector<SyntheticPoint> points;
  std::vector<SyntheticAgent> agents;

  const Rigid3& T_hall_body(const KeyframeId& id) const;
};

SyntheticWorld MakeSyntheticWorld(const SyntheticWorldOptions& options);

// Constraints as fusion and inter_map_ba would send them.
struct SyntheticConstraintOptions {
  double sigma_m = 0.01;
  double sigma_rad = 0.002;
  int num_inliers = 60;
};

// An accepted constraint whose noise is drawn from its covariance, in which translation and
// rotation are correlated.
Constraint MakeTrueConstraint(const SyntheticWorld& world, const KeyframeId& from,
                              const KeyframeId& to, const SyntheticConstraintOptions& options,
                              std::mt19937_64& random);
// A constraint with the same covariance that is wrong by metres.
Constraint MakeFalseConstraint(const SyntheticWorld& world, const KeyframeId& from,
                               const KeyframeId& to, const SyntheticConstraintOptions& options,
                               std::mt19937_64& random);

// Pairs of keyframes that look at the same part of the hall and are at most `distance_m` apart;
// `from` is older than `to` in seq or map. Two keyframes of one map are at least `min_seq_gap`
// apart.
struct OverlappingPair {
  KeyframeId from;
  KeyframeId to;
};
std::vector<OverlappingPair> OverlappingPairs(const SyntheticWorld& world, double distance_m,
                                              int min_seq_gap);

// Makes the agent's odometry one with a wrong scale: one metre of it is exp(log_scale) true metres,
// and its sigma of the scale is `sigma`.
void Unscale(double log_scale, double sigma, SyntheticAgent* agent);
// The constraints for it: those within the map are in its units; those between maps are metric,
// because verification has accounted for the scales.
void Unscale(double log_scale, const MapId& map, std::vector<Constraint>* constraints);

}  // namespace pangea
