#pragma once

// report.html: the whole report as one page that needs nothing else: no network, no further file.

#include <string>

#include "eval/table.h"
#include "report/metrics/report_metrics.h"

namespace pangea::session {

// `anchors_jpeg`: of AnchorsJpeg; empty for none.
std::string ReportHtml(const ReportInput& input, const CapturedSession& session,
                       const ReportMetrics& metrics, const std::string& anchors_jpeg);

// The page with one more section at its end.
std::string WithSection(std::string page, const std::string& id, const std::string& title,
                        const Table& table);

}  // namespace pangea::session
