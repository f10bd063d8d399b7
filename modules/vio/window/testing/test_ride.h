#pragma once

// Runs an estimator through the test world, and records its results beside the truth.

#include <deque>
#include <vector>

#include "vio/window/estimator.h"
#include "vio/window/testing/vio_test_world.h"

namespace pangea::vio {

struct Ride {
  struct Frame {
    int64_t utime;
    FrameResult result;
    ImuState truth;
  };

  explicit Ride(const VioTestWorldOptions& options);
  void Feed(const VioTestWorld::Input& input);
  void Advance(int frames);
  void Flush();
  // The truth in the estimate's odom frame: both share gravity, the yaw and origin of the start.
  Rigid3 T_odom_truth() const;

  VioTestWorld world;
  Estimator estimator;
  std::vector<Frame> tracked;
  std::vector<FinishedKeyframe> finished;
  FrameResult last;
  double started_s = -1;  // since the first image; negative until then
};

// Ten complete rides of 15 s, with a slightly wrong calibration; computed once.
const std::deque<Ride>& TenRides();
// Rides of 6 s with these options. The IMU's scale factors and axes have errors drawn from the
// sigmas in the noise, which the estimator knows.
std::deque<Ride> ShortRides(uint64_t count, const VioTestWorldOptions& options);
// The same rides, each up to its first finished keyframe.
std::deque<Ride> Starts(uint64_t count, const VioTestWorldOptions& options);

}  // namespace pangea::vio
