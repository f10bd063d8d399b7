#pragma once

// report.html: the whole report as one page that needs nothing else, no network and no scripts.

#include <string>

#include "eval/table.h"
#include "session/report_figures.h"

namespace pangea::session {

// Pictures are drawn by gnuplot; where it is missing the page says so in their place.
std::string ReportHtml(const ReportInput& input, const CapturedSession& session,
                       const ReportFigures& figures);

// The page with one more section at its end.
std::string WithSection(std::string page, const std::string& id, const std::string& title,
                        const Table& table);

}  // namespace pangea::session
