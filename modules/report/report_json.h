#pragma once

// report.json without the expectations, which are checked against these metrics.

#include <nlohmann/json_fwd.hpp>

#include "report/metrics/report_metrics.h"

namespace pangea {

nlohmann::ordered_json ReportJson(const ReportInput& input, const CapturedSession& session,
                                  const ReportMetrics& metrics);

}  // namespace pangea
