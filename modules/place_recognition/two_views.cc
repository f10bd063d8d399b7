#include "place_recognition/two_views.h"

#include <algorithm>
#include <utility>
#include <vector>

namespace pangea {
namespace {

// Looser than usual: the epipolar check tolerates wrong matches and measures their probability.
MatchingOptions Matching(DescriptorKind kind) {
  return {.max_distance = LimitsOf(kind).candidate, .max_ratio = 0.85};
}
constexpr uint64_t kSeedSalt = 0x706c616365;  // "place"

std::vector<std::pair<CornerRay, CornerRay>> RayPairs(const std::vector<CornerRay>& a,
                                                      const std::vector<CornerRay>& b,
                                                      const std::vector<CornerMatch>& matches) {
  std::vector<std::pair<CornerRay, CornerRay>> pairs;
  pairs.reserve(matches.size());
  for (const CornerMatch& match : matches) {
    pairs.emplace_back(a[match.a], b[match.b]);
  }
  return pairs;
}

}  // namespace

TwoViewResult CheckTwoViews(const RecognisedKeyframe& query, const RecognisedKeyframe& other,
                            int pairs_up_to) {
  const MatchingOptions matching = Matching(query.descriptor_kind);
  TwoViewResult result;
  result.pairs =
      PairsWithin(query.corners, other.corners, std::max(pairs_up_to, RivalDistance(matching)));
  std::vector<CornerMatch> matches = MutualNearest(result.pairs, other.corners, matching);
  std::erase_if(matches, [&](const CornerMatch& m) {
    return query.rays[m.a].sigma <= 0 || other.rays[m.b].sigma <= 0;
  });
  result.num_matches = static_cast<int>(matches.size());
  if (result.num_matches >= kMinEpipolarInliers) {
    result.epipolar = CheckEpipolar(RayPairs(query.rays, other.rays, matches),
                                    StableHash(query.id, other.id, kSeedSalt));
  }
  return result;
}

}  // namespace pangea
