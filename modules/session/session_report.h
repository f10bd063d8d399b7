#pragma once

// Joins what a run or a replay knows with the captured logs into the report, checks what was
// expected of it, and remembers beside a capture which recordings it came from, so that a later
// replay finds their ground truth.

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "session/replay.h"
#include "session/report.h"
#include "session/session_file.h"
#include "session/session_runner.h"

namespace pangea::session {

// What a session of its own folder remembers beside its log (recordings.json): what each agent
// played, and what was expected of it.
struct Remembered {
  std::vector<AgentRun> agents;
  Expectations expect;
};

struct ReportOutcome {
  std::string text;                 // report.md's
  std::vector<std::string> missed;  // expectations that were not met, a line each
};

// Writes the report of a live run into `out`.
ReportOutcome ReportRun(const SessionScript& script, const RunSummary& summary,
                        const std::filesystem::path& out);

// The same for any log of a server bus. `known` may lack agents of the log.
ReportOutcome ReportLog(const std::filesystem::path& log, const Remembered& known,
                        const std::filesystem::path& out);

void WriteRecordings(const SessionScript& script, const std::filesystem::path& out);
// Of the folders that hold `logs`; empty where there is none. Throws std::runtime_error when one
// cannot be read.
Remembered ReadRecordings(const std::vector<std::filesystem::path>& logs);

}  // namespace pangea::session
