#include "place_recognition/guided_matching.h"

#include <utility>

namespace pangea {

std::vector<std::pair<int, int>> MatchAlongEpipolarLines(std::vector<CornerMatch> pairs,
                                                         const CornersAndRays& a,
                                                         const CornersAndRays& b,
                                                         const EpipolarModel& model,
                                                         const MatchingOptions& matching) {
  // Only rivals up to this distance can make a match fail the ratio test.
  const int rival_distance = static_cast<int>(matching.max_distance / matching.max_ratio);
  std::erase_if(pairs, [&](const CornerMatch& pair) {
    return pair.distance > rival_distance || !(a.rays[pair.a].sigma > 0) ||
           !(b.rays[pair.b].sigma > 0) ||
           !(model.Residual(a.rays[pair.a], b.rays[pair.b]) <= kMaxEpipolarResidual);
  });
  std::vector<std::pair<int, int>> matches;
  for (const CornerMatch& match : MutualNearest(pairs, b.corners, matching)) {
    matches.emplace_back(match.a, match.b);
  }
  return matches;
}

}  // namespace pangea
