#pragma once

// Runs a scripted session with real processes on its own buses, and supervises it.

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "pangea/status_t.hpp"
#include "session/session_file/session_file.h"

namespace pangea::session {

struct RunOptions {
  std::filesystem::path out;           // created; an earlier session there is moved aside
  std::string rate = "1";              // "1", "2", ... or "max"
  std::filesystem::path journal;       // an existing one is continued
  std::optional<uint16_t> first_port;  // if empty, free ports are chosen
};

// Information on a run that the captured logs do not contain.
struct RunSummary {
  double wall_s = 0;
  std::vector<std::string> restarted;      // names, once for each restart
  std::vector<std::string> failures;       // one line for each failure
  std::vector<std::string> notes;          // remarks that are no failures
  std::map<std::string, status_t> status;  // newest status of each process
  std::map<std::string, double> cpu_s;     // of each process, over all its starts
  std::map<int32_t, double> vio_wall_s;    // how long each agent's vio ran
  std::map<int32_t, double> played_s;      // how much of its recording it played
};

// Blocks until every recording is played and the server has finished its work, or until Ctrl-C.
// When nothing is played any more, Ctrl-C ends the session at once. Progress goes to stdout. Throws
// std::runtime_error if the session cannot be started.
RunSummary RunSession(const SessionScript& script, const RunOptions& options);

}  // namespace pangea::session
