#pragma once

// Shows a running session on the terminal: one line per agent, redrawn in place; if the output is a
// file, plain lines every few seconds.

#include <cstdint>
#include <string>
#include <vector>

#include "session/run/session_monitor.h"

namespace pangea::session {

struct AgentLine {
  int32_t id = 0;
  bool started = false;
  bool done = false;
};

class SessionProgress {
 public:
  explicit SessionProgress(bool is_terminal) : is_terminal_(is_terminal) {}

  // Draws if enough time has passed.
  void Update(const std::vector<AgentLine>& agents, const SessionMonitor& monitor,
              double elapsed_s);
  // Prints a line that is not redrawn.
  void PrintLine(const std::string& line);
  void Finish();

 private:
  bool is_terminal_;
  double drawn_at_s_ = -1e9;
  size_t lines_drawn_ = 0;
};

// "agent 1    42.3 s   128 keyframes   fused with 2   drift 0.034 m"
std::string DescribeAgent(const AgentLine& agent, const AgentProgress& progress);

}  // namespace pangea::session
