#pragma once

// The current poses of the other agents in an agent's group.

#include <cstdint>
#include <vector>

#include "core/ids.h"
#include "core/rigid3.h"

namespace pangea {

struct OtherAgent {
  int32_t agent_id = 0;
  Rigid3 T_odom_cam;  // pose of its camera in the odom frame of Others::map
};

inline constexpr size_t kMaxOthers = 16;

struct Others {
  MapId map;  // map of the agent that receives this
  std::vector<OtherAgent> others;
};

}  // namespace pangea
