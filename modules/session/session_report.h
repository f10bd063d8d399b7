#pragma once

// Joins what a run or a replay knows with the captured logs into the report, and checks what was
// expected of it.

#include <filesystem>
#include <string>
#include <vector>

#include "report/report.h"
#include "report/session_record.h"
#include "session/run/session_runner.h"
#include "session/session_file/session_file.h"

namespace pangea::session {

struct ReportOutcome {
  std::string text;                 // report.md's
  std::vector<std::string> missed;  // expectations that were not met, a line each
};

// Writes the report of a live run into `out`. `readings`: as WriteReport's, here and below.
ReportOutcome ReportRun(const SessionScript& script, const RunSummary& summary,
                        const std::filesystem::path& out, LogReadings* readings);

// The same for any log of a server bus. `known` may lack agents of the log.
ReportOutcome ReportLog(const std::filesystem::path& log, const SessionRecord& known,
                        const std::filesystem::path& out, LogReadings* readings);

// What is kept of the session beside its log.
void WriteRecordings(const SessionScript& script, const std::filesystem::path& out);

}  // namespace pangea::session
