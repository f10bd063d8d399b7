#pragma once

// The tables and lists of a report, for its Markdown and its page. A table without rows is left
// out.

#include <string>
#include <vector>

#include "eval/table.h"
#include "report/metrics/report_metrics.h"

namespace pangea {

Table AgentTable(const ReportMetrics& metrics);
Table GroupTable(const ReportMetrics& metrics);
Table LiveTable(const ReportMetrics& metrics);       // poses that agents showed
Table LinksTable(const ReportMetrics& metrics);      // emulated bad links
Table RefusedTable(const CapturedSession& session);  // constraints, by reason
Table TruthTable(const ReportMetrics& metrics);      // accepted constraints against ground truth
Table AnchorTable(const ReportMetrics& metrics);     // shown positions against ground truth
Table ProcessTable(const ReportInput& input, const CapturedSession& session);
Table TrafficTable(const ReportMetrics& metrics);  // on the link, compared with the paper

inline constexpr const char* kLostExplained =
    "Not all of the logs could be read; this is what the rest of them says.";
inline constexpr const char* kAteExplained =
    "ATE: RMSE of positions after SE(3) alignment without scale. It is valid (comparable with "
    "other "
    "results) if the coverage is at least 0.95 and the agent made one map of its recording.";
inline constexpr const char* kAnchorsExplained =
    "Error: median distance between where the agent shows it and where ground truth has it, from "
    "10 s after the fusion on; pixels at 640 wide, where it is in the image. Jump: the largest "
    "step in the agent's odom frame from one image to the next.";
inline constexpr const char* kNeesExplained =
    "NEES: squared error / covariance, per dimension; 1 when the covariance is honest.";
inline constexpr const char* kProcessesExplained =
    "Realtime: seconds of session per second of the process' CPU time. In, out, dropped: messages; "
    "median, p99: handling time of the newest 1000; MB: memory. Counts and CPU time are those "
    "since its last start.";

// One line for each fusion or split of a group.
std::vector<std::string> ChangeLines(const CapturedSession& session, const ReportMetrics& metrics);
// In place of those lines, if there is none.
std::string NoChangeLine(const CapturedSession& session);
// Numbers of accepted and refused constraints.
std::string ConstraintsLine(const CapturedSession& session);

}  // namespace pangea
