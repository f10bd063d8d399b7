#pragma once

// Joins what a run or a replay knows with the captured logs into the report, and checks what was
// expected of it.

#include <filesystem>
#include <string>
#include <vector>

#include "report/report.h"
#include "report/session_record.h"
#include "session/session_file.h"
#include "session/session_runner.h"

namespace pangea::session {

struct ReportOutcome {
  std::string text;                 // report.md's
  std::vector<std::string> missed;  // expectations that were not met, a line each
};

// Writes the report of a live run into `out`.
ReportOutcome ReportRun(const SessionScript& script, const RunSummary& summary,
                        const std::filesystem::path& out);

// The same for any log of a server bus. `known` may lack agents of the log.
ReportOutcome ReportLog(const std::filesystem::path& log, const SessionRecord& known,
                        const std::filesystem::path& out);

// What is kept of the session beside its log.
void WriteRecordings(const SessionScript& script, const std::filesystem::path& out);

}  // namespace pangea::session
