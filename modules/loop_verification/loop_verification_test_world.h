#pragma once

// A small synthetic world for tests of matching and aligning: a room of points with descriptors,
// agents that walk through it, and the keyframes of their odometry, with noise that fits its
// covariances.

#include <cstdint>
#include <utility>
#include <vector>

#include "core/keyframe.h"
#include "core/server_messages.h"

namespace pangea {

struct TestPoint {
  Eigen::Vector3d p_room;
  Descriptor descriptor;
};

struct TestRoomOptions {
  uint64_t seed = 1;
  int num_points = 2600;  // on walls, floor and in the room
  // Objects that look the same in every room with the same object_seed, but stand elsewhere in
  // each.
  int num_objects = 0;
  int points_per_object = 45;
  uint64_t object_seed = 7;
};
std::vector<TestPoint> MakeTestRoom(const TestRoomOptions& options);

struct TestAgentOptions {
  MapId map{1, 1000};
  int num_keyframes = 30;
  // The agent walks on a circle through the room and looks ahead and outward.
  double radius = 2.0;        // metres
  double start_angle = 0;     // radians
  double step_angle = 0.09;   // radians per keyframe
  double height = 1.6;        // metres
  double look_outward = 0.9;  // radians from the direction of travel
  double pixel_sigma = 1.0;
  double relative_depth_sigma = 0.03;
  double edge_sigma_m = 0.003;
  double edge_sigma_rad = 0.0004;  // sigma of yaw; of roll and pitch: a quarter
  double odom_tilt = 0;            // radians, error of the odometry's gravity
  double log_scale = 0;            // the room is exp(log_scale) times as large as the odometry says
  double detect_probability = 0.75;
};

struct TestAgent {
  std::vector<TestPoint> room;
  std::vector<Keyframe> keyframes;
  std::vector<Rigid3> T_room_body;                // truth
  std::vector<std::vector<int>> point_of_corner;  // index in room or -1, by keyframe and corner
};
TestAgent RunTestAgent(const std::vector<TestPoint>& room, const TestAgentOptions& options);

// At most `count` true corner matches (query, match) of two keyframes, and `wrong` random ones.
PlaceCandidate MakeTestCandidate(const TestAgent& query_agent, int query,
                                 const TestAgent& match_agent, int match, int count, int wrong);

// A candidate as from place recognition: mutual nearest descriptors, right or wrong.
PlaceCandidate MakeTestCandidateByDescriptor(const TestAgent& query_agent, int query,
                                             const TestAgent& match_agent, int match);

// The (query, match) pairs with most corners matched by descriptor, at most `count`.
std::vector<std::pair<int, int>> PairsThatShareMost(const TestAgent& query_agent,
                                                    const TestAgent& match_agent, int count);

}  // namespace pangea
