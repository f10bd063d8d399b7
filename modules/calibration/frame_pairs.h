#pragma once

// Pairs of images some tenths of a second apart, with the points that both see.

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "vio/front_end/tracks.h"

namespace pangea::calibration {

struct PointPair {
  Eigen::Vector2d a, b;  // raw pixels
};

struct FramePair {
  double a_s = 0, b_s = 0;  // stamps of the images, seconds since the origin
  std::vector<PointPair> points;
};

struct FramePairOptions {
  double max_gap_s = 0.8;
  double enough_motion_px = 60;  // median: the second image is no later than it takes
  double step_s = 0.1;           // between the first images of pairs
  int min_points = 25;
  int max_points = 50;     // kept of a pair, evenly
  double min_share = 0.4;  // of the first image's points: the second is as late as this allows
};

std::vector<FramePair> MakePairs(const std::vector<vio::TrackedFrame>& frames, int64_t origin_utime,
                                 const FramePairOptions& options);

// At most so many of a pair's points, evenly chosen.
void Thin(int max_points, FramePair* pair);

}  // namespace pangea::calibration
