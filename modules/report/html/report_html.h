#pragma once

// report.html: the whole report as a single page without other files or network access.

#include <string>

#include "eval/table.h"
#include "report/metrics/report_metrics.h"

namespace pangea {

// `anchors_jpeg`: from AnchorsJpeg; empty for none.
std::string ReportHtml(const ReportInput& input, const CapturedSession& session,
                       const ReportMetrics& metrics, const std::string& anchors_jpeg);

// Returns the page with a further section at its end.
std::string WithSection(std::string page, const std::string& id, const std::string& title,
                        const Table& table);

}  // namespace pangea
