#pragma once

// Charts over the session's time: fusion of maps, load of the processes, bytes on the link.

#include "eval/plot.h"
#include "report/metrics/report_metrics.h"

namespace pangea {

// One bar per map, from its first keyframe to its last, in the colour of the agent whose map frame
// it is in; a line marks a change.
Plot FusionChart(const CapturedSession& session, const ReportMetrics& metrics);

// Each process' CPU time per second of the session, in per cent of one core.
Plot LoadChart(const CapturedSession& session, const ReportMetrics& metrics);

// Each agent's kB per second on the link, up and down (the paper's Fig. 4). No lines if nothing was
// measured: a replay has no link.
Plot TrafficChart(const CapturedSession& session, const ReportMetrics& metrics);

}  // namespace pangea
