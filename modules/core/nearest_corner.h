#pragma once

// The search that all matching of descriptors is built of: the nearest corner, and the nearest one
// somewhere else in the image, which a match must be clearly nearer than. Equal distances are
// settled by the lower index.

#include <numeric>
#include <vector>

#include "core/matching.h"

namespace pangea {

struct NearestCorner {
  int index = -1;  // none is near enough
  int distance = kNoDistance;
  int second = kNoDistance;  // of a corner elsewhere: one place may be described on several octaves

  bool PassesRatio(double max_ratio) const { return distance <= max_ratio * second; }
};

// Of `corners[i]` with i in `candidates`; `distance_of(i)` may be kNoDistance: that is none.
template <typename Candidates, typename DistanceOf>
NearestCorner FindNearest(const std::vector<Corner>& corners, const Candidates& candidates,
                          const DistanceOf& distance_of, int max_distance, double other_corner_px) {
  NearestCorner nearest;
  std::vector<int> distances(std::size(candidates));
  size_t k = 0;
  for (const int i : candidates) {
    const int distance = distance_of(i);
    distances[k++] = distance;
    if (distance < nearest.distance) {
      nearest.distance = distance;
      nearest.index = i;
    }
  }
  if (nearest.distance > max_distance) {
    return {};
  }
  k = 0;
  for (const int i : candidates) {
    const int distance = distances[k++];
    if (distance < nearest.second && (corners[i].pixel - corners[nearest.index].pixel).norm() >
                                         static_cast<float>(other_corner_px)) {
      nearest.second = distance;
    }
  }
  return nearest;
}

// Those of `num_a` corners and of `b` that are each other's nearest and pass distance and ratio, in
// the order of a, by `distance_of(a, b)`.
template <typename DistanceOf>
std::vector<CornerMatch> MutualNearest(size_t num_a, const std::vector<Corner>& b,
                                       const DistanceOf& distance_of,
                                       const MatchingOptions& options) {
  std::vector<CornerMatch> nearest_to_b(b.size(), {-1, -1, kNoDistance});
  std::vector<CornerMatch> matches;
  std::vector<int> all_b(b.size());
  std::iota(all_b.begin(), all_b.end(), 0);
  for (int i = 0; i < static_cast<int>(num_a); ++i) {
    const auto distance_from_i = [&](int j) {
      const int distance = distance_of(i, j);
      if (distance < nearest_to_b[j].distance) {
        nearest_to_b[j] = {i, j, distance};
      }
      return distance;
    };
    const NearestCorner nearest =
        FindNearest(b, all_b, distance_from_i, options.max_distance, options.other_corner_px);
    if (nearest.index >= 0 && nearest.PassesRatio(options.max_ratio)) {
      matches.push_back({i, nearest.index, nearest.distance});
    }
  }
  std::erase_if(matches, [&](const CornerMatch& m) { return nearest_to_b[m.b].a != m.a; });
  return matches;
}

}  // namespace pangea
