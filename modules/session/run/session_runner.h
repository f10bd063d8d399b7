#pragma once

// Runs a scripted session with real processes on buses of its own, and watches over it.

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
  std::filesystem::path journal;       // an earlier session's is gone on with
  std::optional<uint16_t> first_port;  // chosen free when not given
};

// What the captured logs cannot tell about a run.
struct RunSummary {
  double wall_s = 0;
  std::vector<std::string> restarted;      // names, once for each restart
  std::vector<std::string> failures;       // one line each: what could not be done
  std::map<std::string, status_t> status;  // newest status of each process
  std::map<int32_t, double> vio_wall_s;    // how long each agent's vio ran
  std::map<int32_t, double> played_s;      // how much of its recording it played
};

// Blocks until every recording is played and the server has worked everything off, or Ctrl-C; once
// nothing is played any more, Ctrl-C ends it at once.
// Progress goes to stdout. Throws std::runtime_error when the session cannot be started.
RunSummary RunSession(const SessionScript& script, const RunOptions& options);

}  // namespace pangea::session
