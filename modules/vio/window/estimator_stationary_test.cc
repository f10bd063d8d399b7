// Tests that the pose of a stationary body is held, also while the body is shaken, and let go when
// it moves.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <numbers>

#include "vio/window/estimator.h"
#include "vio/window/testing/test_ride.h"

namespace pangea::vio {
namespace {

using Eigen::Vector3d;

constexpr double kFirstImage_s = 1;  // of the test world
constexpr double kMotionBegins_s = 20;

double Time_s(const Ride::Frame& frame) { return 1e-6 * static_cast<double>(frame.utime); }

VioTestWorldOptions StationaryWorld(uint64_t seed) {
  VioTestWorldOptions options;
  options.seed = seed;
  options.pixel_noise = 0.2;  // a standing image is tracked better than a moving one
  options.imu_noise = {5e-4, 5e-5, 1e-2, 3e-3, 200};  // a phone's
  options.stationary_begin_s = -1;
  options.stationary_end_s = kMotionBegins_s;
  return options;
}

// As by a motor on the table.
void ShakeSample(ImuSample* sample) {
  const double t = 1e-6 * static_cast<double>(sample->utime);
  const auto wave = [t](double hz) { return std::sin(2 * std::numbers::pi * hz * t); };
  sample->accel += Vector3d(1.5 * wave(31), 1.2 * wave(47), 1.5 * wave(61) + 0.2 * wave(3));
  sample->gyro += 0.05 * Vector3d(wave(43), wave(37), wave(29));
}

// A ride from rest, shaken between two times.
struct Shaken {
  double begin_s = 0, end_s = 0;
};

void AdvanceShaken(Ride* ride, int frames, const Shaken& shaken) {
  for (int i = 0; i < frames; ++i) {
    VioTestWorld::Input input = ride->world.Next();
    for (ImuSample& sample : input.imu) {
      const double t = 1e-6 * static_cast<double>(sample.utime);
      if (t >= shaken.begin_s && t < shaken.end_s) {
        ShakeSample(&sample);
      }
    }
    ride->Feed(input);
  }
}

// A tenth of the pose's usual error.
TEST(Estimator, AStationaryPoseIsHeldAlsoWhileShaken) {
  for (const Shaken& shaken : {Shaken{}, Shaken{6, 14}, Shaken{0, kMotionBegins_s}}) {
    for (const uint64_t seed : {1, 2}) {
      Ride ride(StationaryWorld(seed));
      AdvanceShaken(&ride, static_cast<int>((kMotionBegins_s - kFirstImage_s) * 10), shaken);
      ASSERT_FALSE(ride.tracked.empty()) << ride.last.reason;
      EXPECT_LE(ride.started_s, 1.5);
      for (const Ride::Frame& frame : ride.tracked) {
        EXPECT_TRUE(frame.result.stationary) << Time_s(frame) << " s";
        EXPECT_LT((frame.result.T_odom_body.t - ride.tracked[0].result.T_odom_body.t).norm(), 0.002)
            << Time_s(frame) << " s";
      }
    }
  }
}

// Half a second after it set off, it has moved by a few centimetres.
TEST(Estimator, AShakenBodyIsLetGoWhenItSetsOff) {
  for (const uint64_t seed : {1, 2, 3}) {
    Ride ride(StationaryWorld(seed));
    const Shaken always{0, 100};
    AdvanceShaken(&ride, static_cast<int>((kMotionBegins_s - kFirstImage_s) * 10), always);
    ASSERT_FALSE(ride.tracked.empty()) << ride.last.reason;
    const size_t stationary_poses = ride.tracked.size();
    const Rigid3 T_odom_truth = ride.T_odom_truth();
    AdvanceShaken(&ride, 60, always);
    ASSERT_EQ(ride.last.state, EstimatorState::kTracking) << ride.last.reason;
    const ImuState& stood = ride.tracked[stationary_poses - 1].truth;
    for (size_t i = stationary_poses; i < ride.tracked.size(); ++i) {
      const Ride::Frame& frame = ride.tracked[i];
      const Rigid3 truth = T_odom_truth * frame.truth.T_odom_body;
      const double moved = (frame.truth.T_odom_body.t - stood.T_odom_body.t).norm();
      EXPECT_LT((truth.t - frame.result.T_odom_body.t).norm(), 0.01 + 0.05 * moved)
          << Time_s(frame) << " s, " << moved << " m on";
      EXPECT_TRUE(!frame.result.stationary || moved < 0.03) << Time_s(frame) << " s";
    }
  }
}

// Straight ahead through a long hall, hardly faster than the noise of its distant tracks.
TEST(Estimator, AShakenBodyThatCreepsIsNotHeldForLong) {
  for (const uint64_t seed : {1, 2, 3}) {
    VioTestWorldOptions options = StationaryWorld(seed);
    options.drive_mps = 0.05;
    int held[2] = {0, 0};
    for (const bool is_shaken : {false, true}) {
      Ride ride(options);
      AdvanceShaken(&ride, static_cast<int>((kMotionBegins_s - kFirstImage_s) * 10 + 50),
                    is_shaken ? Shaken{0, 100} : Shaken{});
      ASSERT_EQ(ride.last.state, EstimatorState::kTracking) << ride.last.reason;
      for (const Ride::Frame& frame : ride.tracked) {
        held[is_shaken] += Time_s(frame) > kMotionBegins_s && frame.result.stationary ? 1 : 0;
      }
    }
    std::cout << "creeping, held for " << held[0] << " images, shaken " << held[1] << '\n';
    EXPECT_LE(held[1], held[0] + 1);
    EXPECT_LE(held[1], 5);
  }
}

}  // namespace
}  // namespace pangea::vio
