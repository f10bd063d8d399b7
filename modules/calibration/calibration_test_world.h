#pragma once

// A hand-held camera among points, with random calibration parameters: its tracks and inertial
// samples, exact except for noise.

#include <cstdint>

#include "calibration/calibrate.h"

namespace pangea::calibration {

struct TestWorldOptions {
  uint64_t seed = 1;
  double seconds = 30;
  double image_hz = 30;
  double imu_hz = 200;
  int num_points = 1500;
  double pixel_sigma = 0.4;
  double stamp_sigma_s = 0;
  // In the second half, the interval between images is this many times as long, and the time offset
  // grows by interval_share of the difference.
  double slower = 1;
  double interval_share = 0;
  double outlier_share = 0;  // of the tracks: wrong by up to 6 px in every image
  Eigen::Vector3d rotation_rms = {0.5, 0.6, 0.4};  // rad/s, about the camera's axes
  double rough_rad = 0.06;                         // deviation from an axis-aligned rotation
  bool exact_gyro = false;
};

struct TestWorld {
  Input input;
  Parameters truth;
};

TestWorld MakeTestWorld(const TestWorldOptions& options);

}  // namespace pangea::calibration
