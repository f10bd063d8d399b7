#pragma once

// The paper's tables II to IV beside this session's metrics, for recordings of EuRoC.

#include <optional>
#include <string>
#include <vector>

#include "eval/table.h"
#include "report/metrics/report_metrics.h"

namespace pangea {

// "MH_01" to "MH_05" by the folder's name; empty for any other recording.
std::optional<std::string> SequenceOf(const std::string& recording);

struct PaperTable {
  std::string title;
  Table table;
};

// The tables with at least one row for this session.
std::vector<PaperTable> PaperTables(const ReportMetrics& metrics);

}  // namespace pangea
