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
  // What the interval between images exceeds the recording's usual one.
  double a_excess_s = 0, b_excess_s = 0;
  std::vector<PointPair> points;
};

constexpr double kPairStep_s = 0.1;  // between the first images of pairs
constexpr double kMaxGap_s = 0.8;    // within a pair, at most

// The second image of a pair comes as soon as points have moved far, at most `max_gap_s` later.
std::vector<FramePair> MakePairs(const std::vector<vio::TrackedFrame>& frames, int64_t origin_utime,
                                 double max_gap_s);

// At most so many of a pair's points, evenly chosen.
void Thin(int max_points, FramePair* pair);

}  // namespace pangea::calibration
