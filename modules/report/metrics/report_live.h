#pragma once

// The pose that people saw while the session ran, against ground truth.

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "report/report_log.h"

namespace pangea::session {

struct LiveMetrics {
  std::optional<double> ate_m;       // of the corrected pose
  std::optional<double> ate_raw_m;   // of the raw odometry, over the same stretch
  std::optional<double> jump_max_m;  // of the corrected pose, against the odometry's own motion
};

// Both ATE are SE(3), from the first pose that shows a solve in which its map is fused (for an
// agent that is never fused: the first correction) to the end. What is shown is in one frame as
// long as map and group frame stay; each such stretch has an alignment of its own, the same for
// the raw odometry, and stretches with fewer than kMinPairs poses do not count.
//
// The jump is over all poses: by how much the body moved from one frame to the next that the
// odometry did not see, metres, within one frame of reference.
//
// `fused_revision`: the first revision at which each map is in one group with another.
LiveMetrics LiveMetricsOf(const std::vector<LivePose>& poses,
                          const std::map<MapId, int64_t>& fused_revision,
                          const Trajectory& ground_truth);

}  // namespace pangea::session
