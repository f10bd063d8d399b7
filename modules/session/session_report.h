#pragma once

// Makes the report of a run or a replay from its captured logs and its own data, and checks its
// expectations.

#include <filesystem>
#include <string>
#include <vector>

#include "report/report.h"
#include "report/session_record.h"
#include "session/run/session_runner.h"
#include "session/session_file/session_file.h"

namespace pangea::session {

struct ReportOutcome {
  std::string text;                 // contents of report.md
  std::vector<std::string> missed;  // one line per expectation that was not met
  std::vector<AgentRun> runs;       // with the maps that each agent made, where known
};

// Writes the report of a live run into `out`, and the agents' maps into the session's record, for
// reports of its logs. `readings`: as in WriteReport, here and below.
ReportOutcome ReportRun(const SessionScript& script, const RunSummary& summary,
                        const std::filesystem::path& out, LogReadings* readings);

// The same for any log of a server bus. `known`: the session's record; it may lack agents of the
// log.
ReportOutcome ReportLog(const std::filesystem::path& log, const SessionRecord& known,
                        const std::filesystem::path& out, LogReadings* readings);

// Exit code of a session that misses an expectation, and of logs that differ.
inline constexpr int kMissed = 2;

// Prints the report, and on stderr the missed expectations. Returns the exit code, 0 or kMissed.
int PrintReport(const ReportOutcome& outcome);

// Writes the session's record (report/session_record.h) beside its log.
void WriteRecordings(const SessionScript& script, const std::filesystem::path& out);

}  // namespace pangea::session
