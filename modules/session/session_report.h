#pragma once

// Joins what a run or a replay knows with the captured logs into the report, and remembers beside a
// capture which recordings it came from, so that a later replay finds their ground truth.

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "session/replay.h"
#include "session/report.h"
#include "session/session_file.h"
#include "session/session_runner.h"

namespace pangea::session {

// Writes the report of a live run into `out`; returns report.md's text.
std::string ReportRun(const SessionScript& script, const RunSummary& summary,
                      const std::filesystem::path& out);

// The same for any log of a server bus. `agents` may lack agents of the log.
std::string ReportLog(const std::filesystem::path& log, const std::vector<AgentRun>& agents,
                      const std::filesystem::path& out);

// recordings.json in a session's folder: what each agent played.
void WriteRecordings(const SessionScript& script, const std::filesystem::path& out);
// Of the folders that hold `logs`; empty where there is none. Throws std::runtime_error when one
// cannot be read.
std::vector<AgentRun> ReadRecordings(const std::vector<std::filesystem::path>& logs);

}  // namespace pangea::session
