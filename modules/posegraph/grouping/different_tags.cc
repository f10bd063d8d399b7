#include "posegraph/grouping/different_tags.h"

#include "core/tags/tag_place.h"

namespace pangea {
namespace {

constexpr double kApart_m = 0.1;  // two tags on one wall are not nearer
constexpr double kMaxPlaceSigma_m = 0.4;
constexpr double kDriftPerM = 0.01;

bool AreAtOnePlace(const MapTags::Seen& seen_a, const MapTags::Seen& seen_b,
                   const PairEvidence& evidence, const GraphMap& a, const GraphMap& b) {
  const auto place_a = seen_a.rays.Place(), place_b = seen_b.rays.Place();
  if (!place_a || !place_b) {
    return false;
  }
  const PairEvidence::AgreeingCandidate near = evidence.AgreeingNear(seen_a.node);
  const double path =
      a.chain.PathBetween(near.node_a, seen_a.node) + b.chain.PathBetween(near.node_b, seen_b.node);
  const double sigma = place_a->sigma_m + place_b->sigma_m + near.sigma_m + kDriftPerM * path;
  const Eigen::Vector3d apart = near.T_odom_a_odom_b * place_b->p - place_a->p;
  return sigma <= kMaxPlaceSigma_m && apart.norm() < kApart_m + sigma;
}

}  // namespace

bool HasDifferentTags(const PairEvidence& evidence, const GraphMap& a, const GraphMap& b) {
  if (!evidence.decision().merge || evidence.HasSufficient()) {
    return false;
  }
  for (const auto& [tag_a, seen_a] : a.tags.seen()) {
    for (const auto& [tag_b, seen_b] : b.tags.seen()) {
      // A map that sees both tells itself that they are neighbours.
      if (!a.tags.seen().contains(tag_b) && !b.tags.seen().contains(tag_a) &&
          AreAtOnePlace(seen_a, seen_b, evidence, a, b)) {
        return true;
      }
    }
  }
  return false;
}

}  // namespace pangea
