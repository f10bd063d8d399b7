#pragma once

// The output of the front end for the estimator: the tracked features of one image.

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace pangea::vio {

struct Observation {
  int32_t landmark_id = 0;                          // the same for the whole track
  Eigen::Vector2f pixel = Eigen::Vector2f::Zero();  // raw (distorted)
  // (x, y) with the ray (x, y, 1) through the pixel, camera frame.
  Eigen::Vector2d ray = Eigen::Vector2d::Zero();
  // Standard deviation of the pixel, pixels.
  double sigma_px = 1.0;
};

struct TrackedFrame {
  int64_t utime = 0;  // microseconds, on the clock of the images
  std::vector<Observation> observations;
};

}  // namespace pangea::vio
