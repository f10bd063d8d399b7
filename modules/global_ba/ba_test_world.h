#pragma once

// Agents that fly rounds through one cloud of points, with IMU and rays, for tests of the bundle
// adjustment. Truth, and what an odometry would start it with.

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
  double drift_m_s = 0;      // of the rounds along x, and the cloud is as long
  double max_depth_m = 1e3;  // of a landmark that is seen
  double pixel_sigma = 0.5;  // of the rays, what they claim
  double outlier_share = 0;  // rays of somewhere else
  double edge_sigma_m = 0;   // of odometry edges, what they claim (rad: a tenth); 0: there are none
  double edge_scale_error = 0;  // of all edges
  double noise = 1;             // 0: exact rays and samples
  double scale_error = 0.02;    // of the start
  double start_sigma_m = 0.02;
};

struct BaTestWorld {
  BaWorld truth;  // rays and preintegrations are noisy here too
  BaWorld start;
};

BaTestWorld MakeBaTestWorld(const BaTestOptions& options);

// The same as the server gets it: keyframes whose odometry is the start's, one match and
// verification result between the k-th keyframes of two agents, and the group's state, which is the
// start again.
struct BaTestMessages {
  std::vector<Keyframe> keyframes;
  std::vector<PlaceMatch> matches;
  std::vector<Constraint> constraints;
  MapState state;
};
BaTestMessages MessagesOf(const BaTestWorld& world);

// Largest error of a keyframe's position once position and yaw of the whole, which nothing
// observes, are taken out by the first keyframe's pose.
double WorstError(const BaWorld& world, const BaWorld& truth);

}  // namespace pangea
