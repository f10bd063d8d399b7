#pragma once

// The search that all matching of descriptors is built of: the nearest corner, and the nearest one
// somewhere else in the image, which a match must be clearly nearer than. Equal distances are
// settled by the lower index.

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

}  // namespace pangea
