#pragma once

// report.md.

#include <string>

#include "report/metrics/report_metrics.h"

namespace pangea {

// report.md. `has_anchor_picture`: the file kAnchorPicture exists.
std::string ReportMarkdown(const ReportInput& input, const CapturedSession& session,
                           const ReportMetrics& metrics, bool has_anchor_picture);

}  // namespace pangea
