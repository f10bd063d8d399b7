#include "report/metrics/report_live.h"

#include <gtest/gtest.h>

#include <cmath>

namespace pangea {
namespace {

const MapId kMap{2, 200};
const MapId kOlder{1, 100};
const Rigid3 kMapFromOdom{YawRotation(0.8), {4, -2, 0.5}};
constexpr int64_t kPeriod = 50'000;

Rigid3 WalkedPose(int i) {
  const double s = 0.05 * i;
  return {ExpSo3({0.1 * std::sin(s), 0, 0.3 * s}), {3 * std::cos(0.3 * s), 2 * std::sin(s), 0}};
}

// Poses of 20 s. The raw odometry has 5 % too small a scale. From second 5 on the poses have a
// correction in the map's own frame; from second 10 on they are exact in the older map's frame, but
// for +-`error` in x, of alternating sign from second to second.
struct Shown {
  std::vector<LivePose> poses;
  Trajectory ground_truth;

  explicit Shown(double error) {
    for (int i = 0; i < 400; ++i) {
      const int64_t utime = i * kPeriod;
      ground_truth.push_back({utime, WalkedPose(i)});
      Rigid3 raw = WalkedPose(i);
      raw.t *= 0.95;
      LivePose pose{utime, kMap, kMap, i < 100 ? 0 : 3, raw, raw};
      if (i >= 200) {
        pose.frame = kOlder;
        pose.revision = 6;
        pose.T_map_body = kMapFromOdom * WalkedPose(i);
        pose.T_map_body.t.x() += i / 20 % 2 == 0 ? error : -error;
      }
      poses.push_back(pose);
    }
  }
};

TEST(LiveMetrics, TheErrorIsThatOfWhatWasShownSinceTheFusion) {
  const Shown shown(0.02);
  const LiveMetrics metrics = LiveMetricsOf(shown.poses, {{kMap, 6}}, shown.ground_truth);
  EXPECT_NEAR(*metrics.ate_m, 0.02, 0.002);
  EXPECT_GT(*metrics.ate_raw_m, 0.04);
  EXPECT_LT(*metrics.ate_raw_m, 0.15);
}

TEST(LiveMetrics, WithoutAFusionTheFirstCorrectionBegins) {
  const Shown shown(0);
  const LiveMetrics metrics = LiveMetricsOf(shown.poses, {}, shown.ground_truth);
  // A third of the time since the first correction shows the raw odometry, in a frame of its own.
  EXPECT_GT(*metrics.ate_m, 0.01);
  EXPECT_LT(*metrics.ate_m, *metrics.ate_raw_m);
}

TEST(LiveMetrics, TheJumpIsWhatTheOdometryDidNotSee) {
  Shown shown(0);
  for (LivePose& pose : shown.poses) {
    pose.T_map_body = kMapFromOdom * pose.T_odom_body;
  }
  EXPECT_NEAR(*LiveMetricsOf(shown.poses, {}, {}).jump_max_m, 0, 1e-9)
      << "a new frame, and a rotated one, are no jump";
  for (size_t i = 300; i < shown.poses.size(); ++i) {
    shown.poses[i].T_map_body.t += Eigen::Vector3d(0.03, 0, 0.04);
  }
  EXPECT_NEAR(*LiveMetricsOf(shown.poses, {}, {}).jump_max_m, 0.05, 1e-9);
}

TEST(LiveMetrics, NothingShownNothingSaid) {
  const Shown shown(0);
  const LiveMetrics none = LiveMetricsOf({}, {{kMap, 6}}, shown.ground_truth);
  EXPECT_FALSE(none.ate_m || none.ate_raw_m || none.jump_max_m);
  const LiveMetrics untrue = LiveMetricsOf(shown.poses, {{kMap, 6}}, {});
  EXPECT_FALSE(untrue.ate_m || untrue.ate_raw_m);
  EXPECT_TRUE(untrue.jump_max_m);
}

TEST(LiveMetrics, UncorrectedPosesHaveNoError) {
  Shown shown(0);
  shown.poses.resize(100);
  const LiveMetrics metrics = LiveMetricsOf(shown.poses, {{kMap, 6}}, shown.ground_truth);
  EXPECT_FALSE(metrics.ate_m || metrics.ate_raw_m);
  EXPECT_NEAR(*metrics.jump_max_m, 0, 1e-12);
}

}  // namespace
}  // namespace pangea
