#pragma once

// report.json, but for what was expected of the session: that is checked against these figures.

#include <nlohmann/json_fwd.hpp>

#include "report/metrics/report_figures.h"

namespace pangea::session {

nlohmann::ordered_json ReportJson(const ReportInput& input, const CapturedSession& session,
                                  const ReportFigures& figures);

}  // namespace pangea::session
