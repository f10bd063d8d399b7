#pragma once

// What a report counts and converts, for its JSON, its text and its page alike.

#include <map>
#include <optional>
#include <string>

#include "report/metrics/report_metrics.h"

namespace pangea::session {

struct ConstraintCounts {
  int accepted_intra = 0;
  int accepted_inter = 0;
  std::map<std::string, int> refused;  // by reason, the numbers in it as '#'
  int num_refused = 0;
};

ConstraintCounts CountConstraints(const CapturedSession& session);

// On the link, per second of recording played; none when it was not measured. 1 kB = 1000 B.
std::optional<double> KilobytesPerSecondUp(const AgentMetrics& agent);

// Time in an agent's recording, since its first image.
double RecordingSeconds(const ReportMetrics& metrics, int32_t agent_id, int64_t utime);

}  // namespace pangea::session
