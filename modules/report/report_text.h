#pragma once

// report.md.

#include <string>

#include "report/metrics/report_metrics.h"

namespace pangea::session {

// "1_1700000000000000": a map's name in file names.
std::string FileName(const MapId& map);

std::string ReportMarkdown(const ReportInput& input, const CapturedSession& session,
                           const ReportMetrics& metrics);

}  // namespace pangea::session
