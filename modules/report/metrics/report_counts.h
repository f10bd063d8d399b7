#pragma once

// Counts and conversions shared by the report's JSON, text and page.

#include <map>
#include <optional>
#include <string>

#include "report/metrics/report_metrics.h"

namespace pangea {

struct ConstraintCounts {
  int accepted_intra = 0;
  int accepted_inter = 0;
  int accepted_derived = 0;            // in place of those that thinning removed
  std::map<std::string, int> refused;  // by reason, with '#' for its numbers
  int num_refused = 0;

  int num_accepted() const { return accepted_intra + accepted_inter + accepted_derived; }
};

ConstraintCounts CountConstraints(const CapturedSession& session);

// Uplink traffic per second of recording played; empty if not measured. 1 kB = 1000 B.
std::optional<double> KilobytesPerSecondUp(const AgentMetrics& agent);

// Time in an agent's recording, seconds since its first image.
double RecordingSeconds(const ReportMetrics& metrics, int32_t agent_id, int64_t utime);
// The same by agent, of its newest keyframe in the group that changed; only agents with a map of
// their recording in it.
std::map<int32_t, double> RecordingSeconds(const ReportMetrics& metrics, const GroupChange& change);

}  // namespace pangea
