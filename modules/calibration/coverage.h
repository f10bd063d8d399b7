#pragma once

// Measures, before any solve, how much information a recording has: the user sees during recording
// what is still missing.

#include <Eigen/Core>
#include <cstdint>
#include <span>

#include "calibration/frame_pairs.h"
#include "calibration/parameters.h"
#include "core/imu/imu.h"

namespace pangea::calibration {

// Below these values the user is given advice. kGoodRotation: rad/s rms about an axis, over
// kGood_s.
constexpr double kGood_s = 20, kGoodPoints = 40, kGoodRotation = 0.1;

struct Coverage {
  double seconds = 0;  // covered by pairs
  double points = 0;   // per pair, median
  // Rms rotation rates about the camera's axes while points were seen, rad/s.
  Eigen::Vector3d rotation_rms = Eigen::Vector3d::Zero();

  // Share of the desired rotation about `axis` (0: up and down), 0 to 1; accumulated over time.
  double RotationShare(int axis) const;
  // Share of all requirements: 1 if nothing is missing.
  double Share() const;
};

// Of `parameters` only rotation, gyro bias and time offset are used.
Coverage CoverageOf(std::span<const FramePair> pairs, std::span<const ImuSample> imu,
                    int64_t origin_utime, const Parameters& parameters);

}  // namespace pangea::calibration
