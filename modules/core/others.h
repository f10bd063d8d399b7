#pragma once

// Where the other agents of an agent's group are now.

#include <cstdint>
#include <vector>

#include "core/ids.h"
#include "core/rigid3.h"

namespace pangea {

struct OtherAgent {
  int32_t agent_id = 0;
  Rigid3 T_odom_cam;  // its camera, in the odom frame of Others::map
};

inline constexpr size_t kMaxOthers = 16;

struct Others {
  MapId map;  // of the agent that they are for
  std::vector<OtherAgent> others;
};

}  // namespace pangea
