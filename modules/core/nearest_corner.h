#pragma once

// The search that all descriptor matching uses. It finds the nearest corner, and, for the ratio
// test, the nearest corner elsewhere in the image. Of equal distances the first candidate wins.

#include <vector>

#include "core/matching.h"

namespace pangea {

struct NearestCorner {
  int index = -1;  // -1: no corner is near enough
  int distance = kNoDistance;
  // Distance of the nearest corner elsewhere. A corner at the same place does not count, because
  // one place may be described on several octaves.
  int second = kNoDistance;

  bool PassesRatio(double max_ratio) const { return distance <= max_ratio * second; }
};

// Searches `corners[i]` for each i in `candidates`. An i with distance_of(i) == kNoDistance is
// ignored. "Elsewhere" means more than `other_corner_px` pixels from the nearest corner. Distances
// are computed a second time only if a corner is near enough, which costs less than to store them.
template <typename Candidates, typename DistanceOf>
NearestCorner FindNearest(const std::vector<Corner>& corners, const Candidates& candidates,
                          const DistanceOf& distance_of, int max_distance, double other_corner_px) {
  NearestCorner nearest;
  for (const int i : candidates) {
    const int distance = distance_of(i);
    if (distance < nearest.distance) {
      nearest.distance = distance;
      nearest.index = i;
    }
  }
  if (nearest.distance > max_distance) {
    return {};
  }
  for (const int i : candidates) {
    const int distance = distance_of(i);
    if (distance < nearest.second && (corners[i].pixel - corners[nearest.index].pixel).norm() >
                                         static_cast<float>(other_corner_px)) {
      nearest.second = distance;
    }
  }
  return nearest;
}

}  // namespace pangea
