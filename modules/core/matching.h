#pragma once

// Matching of binary descriptors: whole keyframe against whole keyframe, and guided by where a
// point should appear. Pixels are raw (distorted) pixels throughout. Nothing here is random: equal
// distances are settled by the lower index.

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <tuple>
#include <vector>

#include "core/keyframe.h"

namespace pangea {

struct MatchingOptions {
  int max_distance = kAlikeHamming;  // bits
  double max_ratio = 0.8;            // best distance / second best; 1 switches the test off
};

struct CornerMatch {
  int a = 0;  // index into the first list of corners
  int b = 0;  // index into the second
  int distance = 0;
};

// From a match no rival further away than this can take the ratio test.
inline int RivalDistance(const MatchingOptions& options) {
  return std::min(kDescriptorBits, static_cast<int>(options.max_distance / options.max_ratio) + 1);
}

// Descriptors word by word, so that one is compared with many at a time.
class DescriptorList {
 public:
  explicit DescriptorList(const std::vector<Corner>& corners);

  // Of each the Hamming distance to `descriptor`. `distances` has their number.
  void Distances(const Descriptor& descriptor, std::vector<uint64_t>* distances) const;

 private:
  std::array<std::vector<uint64_t>, std::tuple_size_v<Descriptor>> words_;
};

// All pairs of corners no further apart than that, in the order of a, then of b.
std::vector<CornerMatch> PairsWithin(const std::vector<Corner>& a, const std::vector<Corner>& b,
                                     int max_distance);

// Those of `pairs`, which are in that order, that are each other's nearest and pass distance and
// ratio. They must be there up to RivalDistance.
std::vector<CornerMatch> MutualNearest(const std::vector<CornerMatch>& pairs,
                                       const std::vector<Corner>& b,
                                       const MatchingOptions& options);

// Mutual nearest neighbours that pass the ratio test, in the order of a.
std::vector<CornerMatch> MatchCorners(const std::vector<Corner>& a, const std::vector<Corner>& b,
                                      const MatchingOptions& options);

// Corners by image position, for "the nearest descriptor within r pixels of here".
class CornerGrid {
 public:
  // Keeps a pointer: `corners` must outlive the grid.
  explicit CornerGrid(const std::vector<Corner>& corners);

  // Indices of the corners within `radius_px`, ascending.
  std::vector<int> Within(const Eigen::Vector2d& pixel, double radius_px) const;
  // The one of these with the nearest descriptor (`a` of the result is 0), if it passes distance
  // and ratio.
  std::optional<CornerMatch> Nearest(const Eigen::Vector2d& pixel, double radius_px,
                                     const Descriptor& descriptor,
                                     const MatchingOptions& options) const;

 private:
  int Column(double u) const;
  int Row(double v) const;

  const std::vector<Corner>* corners_;
  Eigen::Vector2d origin_ = Eigen::Vector2d::Zero();  // of cell (0, 0), pixels
  int columns_ = 1;
  int rows_ = 1;
  std::vector<std::vector<int>> cells_;
};

}  // namespace pangea
