#pragma once

// A whole world for tests, from one options struct: a hall of points with descriptors, agents that
// walk hand-held through it on overlapping rounds, and the complete keyframes their odometry would
// send, with truth alongside. The noise is what the keyframes' covariances claim. Seeded: the same
// options give the same world.
//
// Frames: `hall` is the truth's own gravity-aligned frame; each agent's odom frame lies anyhow to
// it (yaw, origin), and drifts.

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
  // Objects that look the same in every world with the same object_seed, at places of its own.
  int num_objects = 0;
  int points_per_object = 40;
  uint64_t object_seed = 7;

  int num_agents = 2;
  int num_keyframes = 60;  // of each agent
  double step_m = 0.4;     // walked between keyframes
  // Agents start this share of a round apart.
  double start_apart = 0.1;
  int64_t opened_utime = 1000;  // of the first agent's map; one more for each next

  // False makes keyframes without corners and points: quick, for whoever needs poses only.
  bool with_corners = true;
  double pixel_sigma = 1.0;  // at octave 0
  double flip_probability = 0.07;
  double detect_probability = 0.75;
  double tracked_share = 0.35;  // of the points
  int clutter = 60;             // corners nobody sees again
  double relative_depth_sigma = 0.03;

  // Drift of each edge, standard deviations, and what the keyframes claim of it.
  double edge_sigma_m = 0.004;
  double edge_sigma_yaw = 0.0006;
  double tilt_sigma = 0.001;       // roll and pitch: bounded by gravity
  double claimed_sigma_scale = 1;  // below one: an odometry that believes too much of itself
};

struct SyntheticAgent {
  MapId map;
  std::vector<Keyframe> keyframes;
  std::vector<Rigid3> T_hall_body;
  // Index of the world's point for each corner of each keyframe, -1 for clutter.
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

// An accepted constraint; its noise follows its covariance, which correlates translation and
// rotation.
Constraint MakeTrueConstraint(const SyntheticWorld& world, const KeyframeId& from,
                              const KeyframeId& to, const SyntheticConstraintOptions& options,
                              std::mt19937_64& random);
// As confident, metres off.
Constraint MakeFalseConstraint(const SyntheticWorld& world, const KeyframeId& from,
                               const KeyframeId& to, const SyntheticConstraintOptions& options,
                               std::mt19937_64& random);

// Pairs (from older, to newer in seq or map) that look at the same part of the hall from up to
// `distance_m` apart, at least `min_seq_gap` apart if they are of one map.
struct KeyframePair {
  KeyframeId from;
  KeyframeId to;
};
std::vector<KeyframePair> OverlappingPairs(const SyntheticWorld& world, double distance_m,
                                           int min_seq_gap);

}  // namespace pangea
