#include "place_recognition/guided_matching.h"

#include "core/nearest_corner.h"

namespace pangea {

std::vector<std::pair<int, int>> MatchAlongEpipolarLines(const CornersAndRays& a,
                                                         const CornersAndRays& b,
                                                         const EpipolarModel& model,
                                                         double max_residual,
                                                         const MatchingOptions& options) {
  // A rival counts for the ratio test up to the distance at which it could no longer fail it.
  const int rival_distance = static_cast<int>(options.max_distance / options.max_ratio);
  const auto distance_of = [&](int i, int j) {
    const int distance = HammingDistance(a.corners[i].descriptor, b.corners[j].descriptor);
    const bool along_the_line = distance <= rival_distance && a.rays[i].sigma > 0 &&
                                b.rays[j].sigma > 0 &&
                                model.Residual(a.rays[i], b.rays[j]) <= max_residual;
    return along_the_line ? distance : kNoDistance;
  };
  std::vector<std::pair<int, int>> matches;
  for (const CornerMatch& match :
       MutualNearest(a.corners.size(), b.corners, distance_of, options)) {
    matches.emplace_back(match.a, match.b);
  }
  return matches;
}

}  // namespace pangea
