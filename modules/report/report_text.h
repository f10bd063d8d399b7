#pragma once

// report.md.

#include <string>

#include "report/metrics/report_metrics.h"

namespace pangea {

// A map's name in file names: "1_1700000000000000".
std::string FileName(const MapId& map);

// report.md. `has_anchor_picture`: the file kAnchorPicture exists.
std::string ReportMarkdown(const ReportInput& input, const CapturedSession& session,
                           const ReportMetrics& metrics, bool has_anchor_picture);

}  // namespace pangea
