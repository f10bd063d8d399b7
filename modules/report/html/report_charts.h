#pragma once

// What went on while the session ran, over its time: maps becoming one, the processes' load, bytes
// on the link.

#include "eval/plot.h"
#include "report/metrics/report_metrics.h"

namespace pangea::session {

// A bar for each map, from its first keyframe to its last, in the colour of the agent in whose map
// frame it is; a line where that changes.
Plot FusionChart(const CapturedSession& session, const ReportMetrics& metrics);

// Each process' CPU time per second of the session, in per cent of one core.
Plot LoadChart(const CapturedSession& session, const ReportMetrics& metrics);

// Each agent's kB per second on the link, up and down (the paper's Fig. 4). No lines when nothing
// was measured: a replay has no link.
Plot TrafficChart(const CapturedSession& session, const ReportMetrics& metrics);

}  // namespace pangea::session
