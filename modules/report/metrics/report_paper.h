#pragma once

// The paper's tables II to IV beside this session's metrics, where its recordings are EuRoC's.

#include <optional>
#include <string>
#include <vector>

#include "eval/table.h"
#include "report/metrics/report_metrics.h"

namespace pangea::session {

// "MH_01" to "MH_05" by the folder's name; nothing for any other recording.
std::optional<std::string> SequenceOf(const std::string& recording);

struct PaperTable {
  std::string title;
  Table table;
};

// Those that have something of this session, each with at least one row.
std::vector<PaperTable> PaperTables(const ReportMetrics& metrics);

}  // namespace pangea::session
