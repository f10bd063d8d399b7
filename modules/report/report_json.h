#pragma once

// report.json, but for what was expected of the session: that is checked against these metrics.

#include <nlohmann/json_fwd.hpp>

#include "report/metrics/report_metrics.h"

namespace pangea::session {

nlohmann::ordered_json ReportJson(const ReportInput& input, const CapturedSession& session,
                                  const ReportMetrics& metrics);

}  // namespace pangea::session
