#pragma once

// The tables and lists of a report, for its Markdown and its page alike. A table without rows has
// nothing to tell.

#include <string>
#include <vector>

#include "eval/table.h"
#include "report/metrics/report_metrics.h"

namespace pangea::session {

Table AgentTable(const ReportMetrics& metrics);
Table GroupTable(const ReportMetrics& metrics);
Table LiveTable(const ReportMetrics& metrics);       // what agents showed
Table LinksTable(const ReportMetrics& metrics);      // links that the session made bad
Table RefusedTable(const CapturedSession& session);  // constraints, by reason
Table TruthTable(const ReportMetrics& metrics);      // accepted constraints against ground truth
Table AnchorTable(const ReportMetrics& metrics);     // where they are shown, against ground truth
Table ProcessTable(const ReportInput& input, const CapturedSession& session);
Table TrafficTable(const ReportMetrics& metrics);  // on the link, beside the paper's

inline constexpr const char* kLostExplained =
    "Not all of the logs could be read; this is what the rest of them says.";
inline constexpr const char* kAnchorsExplained =
    "Error: median distance between where the agent shows it and where ground truth has it, from "
    "10 s after the fusion on; pixels at 640 wide, where it is in the image. Jump: the largest "
    "step in the agent's odom frame from one image to the next.";
inline constexpr const char* kNeesExplained =
    "NEES: squared error / covariance, per dimension; 1 when the covariance is honest.";

// When maps became one or were taken apart, a line each.
std::vector<std::string> ChangeLines(const CapturedSession& session, const ReportMetrics& metrics);
// How many constraints were accepted and refused.
std::string ConstraintsLine(const CapturedSession& session);

}  // namespace pangea::session
