#pragma once

// report.md.

#include <string>

#include "report/metrics/report_metrics.h"

namespace pangea::session {

// "1_1700000000000000": a map's name in file names.
std::string FileName(const MapId& map);

// `has_anchor_picture`: kAnchorPicture is beside it.
std::string ReportMarkdown(const ReportInput& input, const CapturedSession& session,
                           const ReportMetrics& metrics, bool has_anchor_picture);

}  // namespace pangea::session
