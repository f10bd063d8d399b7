#pragma once

// How much a recording tells, before anything is solved: whoever records sees what is still
// missing.

#include <Eigen/Core>
#include <cstdint>
#include <span>

#include "calibration/frame_pairs.h"
#include "calibration/parameters.h"
#include "core/imu/imu.h"

namespace pangea::calibration {

// Advice is given below these. In rotation rad/s rms about an axis, over kGood_s.
constexpr double kGood_s = 20, kGoodPoints = 40, kGoodRotation = 0.1;

struct Coverage {
  double seconds = 0;  // of pairs
  double points = 0;   // of a pair, median
  // rad/s about the camera's axes, while points were seen; rms.
  Eigen::Vector3d rotation_rms = Eigen::Vector3d::Zero();

  // Of what is good for `axis` (0: up and down), 0 to 1: its rotation, summed over the time.
  double RotationShare(int axis) const;
  // Of what is good in all: 1 when nothing is missing.
  double Share() const;
};

// Only the rotation of `parameters`, the gyroscope's bias and the time offset count.
Coverage CoverageOf(std::span<const FramePair> pairs, std::span<const ImuSample> imu,
                    int64_t origin_utime, const Parameters& parameters);

}  // namespace pangea::calibration
