#include "report/metrics/report_live.h"

#include <algorithm>
#include <cmath>

#include "eval/metrics.h"

namespace pangea {
namespace {

using Iterator = std::vector<LivePose>::const_iterator;

bool SameFrame(const LivePose& a, const LivePose& b) {
  return a.map == b.map && a.frame == b.frame;
}

Iterator Begin(const std::vector<LivePose>& poses, const std::map<MapId, int64_t>& fused_revision) {
  const auto fused = std::ranges::find_if(poses, [&](const LivePose& pose) {
    const auto revision = fused_revision.find(pose.map);
    return revision != fused_revision.end() && pose.revision >= revision->second;
  });
  return fused != poses.end()
             ? fused
             : std::ranges::find_if(poses, [](const LivePose& p) { return p.revision > 0; });
}

// Sums squared errors over parts with separate alignments.
class PooledAte {
 public:
  void Add(const Trajectory& stretch, const Trajectory& ground_truth) {
    if (const auto ate =
            AbsoluteError(Associate(stretch, ground_truth), TrajectoryAlignmentKind::kSe3)) {
      for (const PoseError& error : ate->errors) {
        errors_.push_back(error.position_m);
      }
    }
  }
  std::optional<double> Rmse() const {
    return errors_.empty() ? std::nullopt : std::optional(StatisticsOf(errors_).rmse);
  }

 private:
  std::vector<double> errors_;
};

std::optional<double> JumpMax(const std::vector<LivePose>& poses) {
  if (poses.empty()) {
    return std::nullopt;
  }
  double largest = 0;
  for (size_t i = 1; i < poses.size(); ++i) {
    const LivePose& before = poses[i - 1];
    const LivePose& now = poses[i];
    if (SameFrame(before, now)) {
      // Both motions in the body frame before the motion.
      const Rigid3 shown = before.T_map_body.Inverse() * now.T_map_body;
      const Rigid3 raw = before.T_odom_body.Inverse() * now.T_odom_body;
      largest = std::max(largest, (shown.t - raw.t).norm());
    }
  }
  return largest;
}

}  // namespace

LiveMetrics LiveMetricsOf(const std::vector<LivePose>& poses,
                          const std::map<MapId, int64_t>& fused_revision,
                          const Trajectory& ground_truth) {
  PooledAte corrected;
  PooledAte raw;
  for (auto it = Begin(poses, fused_revision); it != poses.end();) {
    const LivePose& first = *it;
    Trajectory shown;
    Trajectory odometry;
    for (; it != poses.end() && SameFrame(first, *it); ++it) {
      shown.push_back({it->utime, it->T_map_body});
      odometry.push_back({it->utime, it->T_odom_body});
    }
    corrected.Add(shown, ground_truth);
    raw.Add(odometry, ground_truth);
  }
  return {corrected.Rmse(), raw.Rmse(), JumpMax(poses)};
}

}  // namespace pangea
