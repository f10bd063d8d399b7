#pragma once

// Generates paths along a scene's route (route.h): a hand-held walk, or the flight of a drone that
// tilts with its accelerations. A path makes several rounds in the same area, so that two paths of
// one scene overlap.

#include <cstdint>

#include "recording/trajectory.h"
#include "sim/scene/scene_builder.h"

namespace pangea::sim {

enum class Motion { kWalk, kFlight };

struct GeneratedPathOptions {
  Motion motion = Motion::kWalk;
  SceneKind scene = SceneKind::kHall;
  uint64_t seed = 1;
  double duration_s = 60;
  double static_start_s = 0;  // initially stationary; 0: moving from the first frame
  Eigen::Quaterniond q_body_cam = Eigen::Quaterniond::Identity();  // the camera looks ahead
};

// T_ref_body at 50 Hz.
Trajectory GeneratePath(const GeneratedPathOptions& options);

}  // namespace pangea::sim
