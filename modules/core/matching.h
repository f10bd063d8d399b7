#pragma once

// Matching of binary descriptors: one whole keyframe against another, or near a predicted pixel.
// All pixels are raw (distorted). Nothing here is random: of equal distances the lower index wins.

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
  int max_distance = LimitsOf(DescriptorKind::kOrb).alike;  // bits
  double max_ratio = 0.8;  // best distance / second best; 1 switches the test off
};

struct CornerMatch {
  int a = 0;  // index into the first list of corners
  int b = 0;  // index into the second
  int distance = 0;
};

// A rival with a larger distance than this, in bits, cannot make any match fail the ratio test.
inline int RivalDistance(const MatchingOptions& options) {
  return std::min(kDescriptorBits, static_cast<int>(options.max_distance / options.max_ratio) + 1);
}

// Descriptors stored word by word, so that one is compared with many at a time.
class DescriptorList {
 public:
  explicit DescriptorList(const std::vector<Corner>& corners);

  // The Hamming distance of each descriptor to `descriptor`. The caller sizes `distances`: one
  // element for each descriptor of the list.
  void Distances(const Descriptor& descriptor, std::vector<uint64_t>* distances) const;

 private:
  std::array<std::vector<uint64_t>, std::tuple_size_v<Descriptor>> words_;
};

// All pairs of corners with a Hamming distance of at most `max_distance`, ordered by (a, b).
std::vector<CornerMatch> PairsWithin(const std::vector<Corner>& a, const std::vector<Corner>& b,
                                     int max_distance);

// The pairs that are mutual nearest neighbours and pass the distance and ratio tests. `pairs`
// must be ordered by (a, b) and contain all pairs up to RivalDistance.
std::vector<CornerMatch> MutualNearest(const std::vector<CornerMatch>& pairs,
                                       const std::vector<Corner>& b,
                                       const MatchingOptions& options);

// Mutual nearest neighbours that pass the distance and ratio tests, ordered by a.
std::vector<CornerMatch> MatchCorners(const std::vector<Corner>& a, const std::vector<Corner>& b,
                                      const MatchingOptions& options);

// Corners sorted into grid cells of the image, to find those near a pixel quickly.
class CornerGrid {
 public:
  // Keeps a pointer: `corners` must outlive the grid.
  explicit CornerGrid(const std::vector<Corner>& corners);

  // Indices of the corners within `radius_px`, ascending.
  std::vector<int> Within(const Eigen::Vector2d& pixel, double radius_px) const;
  // The corner within `radius_px` with the nearest descriptor, if it passes the distance and ratio
  // tests. `a` of the result is 0.
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
