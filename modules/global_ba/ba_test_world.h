#pragma once

// For tests of the bundle adjustment: agents that fly in circles through a point cloud, with IMU
// and rays; the truth, and initial values as from an odometry.

#include <cstdint>

#include <vector>

#include "core/keyframe.h"
#include "core/server_messages.h"
#include "global_ba/ba_problem.h"

namespace pangea {

struct BaTestOptions {
  uint64_t seed = 1;
  int agents = 2;
  int keyframes = 20;  // of each agent
  double step_s = 0.5;
  int landmarks = 150;
  double drift_m_s = 0;         // motion of the circles along x, m/s; the cloud is as long
  double max_depth_m = 1e3;     // of a visible landmark
  double pixel_sigma = 0.5;     // sigma of the rays, actual and stated
  double outlier_share = 0;     // share of rays to wrong points
  double edge_sigma_m = 0;      // of odometry edges, actual and stated (rad: a tenth); 0: no edges
  double edge_scale_error = 0;  // relative, of all edges
  bool imu = true;              // false: keyframes without preintegration
  double noise = 1;             // 0: exact rays and samples
  double scale_error = 0.02;    // relative, of the initial values
  double start_sigma_m = 0.02;
};

struct BaTestWorld {
  BaWorld truth;  // rays and preintegrations contain noise here too
  BaWorld start;
};

BaTestWorld MakeBaTestWorld(const BaTestOptions& options);

// The same world as messages of the server: keyframes whose odometry is the start, with the world's
// edges if it has any, one match and verification result between the k-th keyframes of two agents,
// and the group's state, which is also the start.
struct BaTestMessages {
  std::vector<Keyframe> keyframes;
  std::vector<PlaceMatch> matches;
  std::vector<Constraint> constraints;
  MapState state;
};
BaTestMessages MessagesOf(const BaTestWorld& world);

// Largest position error of a keyframe, m, after alignment of the (unobservable) position and yaw
// by the first keyframe's pose.
double WorstError(const BaWorld& world, const BaWorld& truth);

// Sum of the distances between successive keyframes of each map, m.
double PathLength(const BaWorld& world);

}  // namespace pangea
