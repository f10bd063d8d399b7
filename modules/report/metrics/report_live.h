#pragma once

// Compares the pose that agents showed during the session with ground truth.

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "report/report_log.h"

namespace pangea {

struct LiveMetrics {
  std::optional<double> ate_m;       // of the corrected pose
  std::optional<double> ate_raw_m;   // of the raw odometry, over the same time
  std::optional<double> jump_max_m;  // of the corrected pose, beyond the odometry's own motion
};

// Both ATE use SE(3) alignment, and begin at the first pose with a correction in which its map is
// fused (for an agent that is never fused: the first correction). The shown poses are in one frame
// as long as map and group frame do not change; each such part has its own alignment, also for the
// raw odometry. Parts with fewer than kMinPairs poses do not count.
//
// The jump is over all poses: the displacement of the shown body from one image to the next that is
// not in the odometry, metres, within one frame of reference.
//
// `fused_revision`: by map, the first revision at which it is in a group with another map.
LiveMetrics LiveMetricsOf(const std::vector<LivePose>& poses,
                          const std::map<MapId, int64_t>& fused_revision,
                          const Trajectory& ground_truth);

}  // namespace pangea
