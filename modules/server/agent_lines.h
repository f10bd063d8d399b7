#pragma once

// Follows the log of the agent_handler for what people at the server's console want to know: which
// agents join, and which are refused, and why. The agent_handler tells each of it once.

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace pangea {

class AgentLines {
 public:
  // `log`: the file that has the agent_handler's output. What it has already is of earlier runs.
  explicit AgentLines(std::filesystem::path log);

  // The new lines about agents, such as "agent 4 has joined". Call about every 100 ms.
  std::vector<std::string> Take();

 private:
  const std::filesystem::path log_;
  std::uintmax_t read_ = 0;  // bytes
};

}  // namespace pangea
