#pragma once

// Pairs of images some tenths of a second apart, with their common points.

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
  // Excess of the interval between images over the recording's usual one.
  double a_excess_s = 0, b_excess_s = 0;
  std::vector<PointPair> points;
};

constexpr double kPairStep_s = 0.1;  // between the first images of successive pairs
constexpr double kMaxGap_s = 0.8;    // maximum within a pair

// The second image of a pair is the one at which points have moved far enough, at most `max_gap_s`
// after the first.
std::vector<FramePair> MakePairs(const std::vector<vio::TrackedFrame>& frames, int64_t origin_utime,
                                 double max_gap_s);

// Reduces a pair to at most `max_points` points, evenly chosen.
void Thin(int max_points, FramePair* pair);

}  // namespace pangea::calibration
