#pragma once

// An estimator on its way through the test world, and what it said beside the truth.

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

// Rides of 15 s to their end, with a calibration that is slightly off; made once.
const std::deque<Ride>& TenRides();
// Rides of 6 s like these, in worlds with these options. The IMU's scale factors and axes are off
// by what the noise says, which the estimator is told.
std::deque<Ride> ShortRides(uint64_t count, const VioTestWorldOptions& options);

}  // namespace pangea::vio
