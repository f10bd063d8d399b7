#pragma once

// Reads keyframe logs with their ground truth.

#include <map>
#include <string>
#include <vector>

#include "core/keyframe.h"
#include "recording/trajectory.h"

namespace pangea::bench {

struct AgentInput {
  int32_t id = 0;
  std::string keyframes;  // an LCM log; other agents' keyframes in it are skipped
  std::string reference;  // a TUM or EuRoC ground-truth file, or a recording's folder
};

struct Input {
  std::vector<Keyframe> keyframes;      // interleaved as if all agents had started together
  std::map<int32_t, Trajectory> truth;  // by agent
};

// Throws std::runtime_error with a one-line message for the user.
Input ReadInput(const std::vector<AgentInput>& agents);

}  // namespace pangea::bench
