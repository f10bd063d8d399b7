#pragma once

// Who gives a session's agent its keyframes: a vio, or the player of its stored keyframes. Ends by
// itself when its recording is over; the vio of a live agent is ended.

#include <optional>
#include <string>
#include <vector>

#include "session/processes/child_process.h"
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
  // A live one has had its duration.
  bool IsOver() const;
};

// Throws std::runtime_error, naming the agent, about a recording that its odometry would refuse.
void CheckRecording(const AgentScript& script);

// What it plays, as arguments of its program.
std::vector<std::string> InputOf(const Player& player, const std::string& rate);

// For people: where the sensors of a live agent are awaited.
std::string DescribeLive(const AgentScript& script, const std::string& bus);

}  // namespace pangea::session
