#pragma once

// A scripted session: which recordings are played by which agents, and when.
//
//   agents:
//     - {id: 1, recording: ../recordings/MH_01}
//     - {id: 2, recording: ../recordings/MH_02, delay: 5, start: 10, duration: 60}

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace pangea::session {

struct AgentScript {
  int32_t id = 0;                  // 1 .. 65535, unique in the session
  std::string recording;           // folder, relative to the session file or to --recordings
  double delay_s = 0;              // session time at which the agent starts
  double start_s = 0;              // where in the recording it starts
  double duration_s = 0;           // how much of it is played; 0 = to the end
  std::filesystem::path resolved;  // the folder, found
};

struct SessionScript {
  std::vector<AgentScript> agents;
};

// Reads and checks a session file and finds its recordings: relative to `recordings` if that is
// given, else to the file's own folder; there, MH_01 also finds MH_01_easy. Throws
// std::runtime_error that names file, key and mend, and every recording that is missing.
SessionScript ReadSessionFile(const std::filesystem::path& file,
                              const std::optional<std::filesystem::path>& recordings);

}  // namespace pangea::session
