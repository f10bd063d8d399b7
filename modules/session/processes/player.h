#pragma once

// The source of an agent's keyframes in a session: pangea-vio, or the player of its stored
// keyframes. It ends by itself when its recording is over; the vio of a live agent is stopped.

#include <optional>
#include <string>
#include <vector>

#include "processes/child_process.h"
#include "session/session_file/session_file.h"

namespace pangea::session {

// Wall clock, seconds.
double Now();

struct Player {
  AgentScript script;
  std::optional<ChildProcess> child;
  double started_s = 0;
  double ended_s = 0;
  double played_before_s = 0;  // seconds of recording played by earlier runs of a restarted vio
  int restarts = 0;
  bool is_told_to_end = false;

  bool done() const { return ended_s > 0; }
  // Whether a live agent has reached its duration.
  bool IsOver() const;
};

// Throws std::runtime_error that names the agent if its odometry would refuse the recording.
void CheckRecording(const AgentScript& script);

// The program's arguments for its input.
std::vector<std::string> InputOf(const Player& player, const std::string& rate);

// For people: the channels on which a live agent's sensors are expected.
std::string DescribeLive(const AgentScript& script, const std::string& bus);

}  // namespace pangea::session
