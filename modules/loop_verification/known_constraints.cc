#include "loop_verification/known_constraints.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "core/candidates/candidate_order.h"
#include "core/median.h"

namespace pangea {
namespace {

// Sigma of the odometry's position per metre of path; the same as in pair_evidence.cc.
constexpr double kDriftPerM = 0.02;

// Path length between two keyframes of one map, m.
std::optional<double> PathBetween(const MapId& map, int32_t a, int32_t b,
                                  const KeyframeStore& store) {
  return store.PathBetween({map, std::min(a, b)}, {map, std::max(a, b)});
}

}  // namespace

void KnownConstraints::Add(const Constraint& constraint) {
  const auto [a, b] = std::minmax(constraint.from, constraint.to);
  by_maps_[{a.map, b.map}].insert({a.seq,
                                   {a.seq, b.seq, a == constraint.to,
                                    LargestSigma(constraint.covariance.topLeftCorner<3, 3>())}});
}

bool KnownConstraints::IsRedundant(const KeyframeId& query, const KeyframeId& match,
                                   const KeyframeStore& store) const {
  const Nearby nearby = NearbyOf(query, match, store);
  if (nearby.gain_bits >= options_.min_gain_bits) {
    return false;
  }
  return query.map == match.map ? nearby.count >= options_.min_nearby
                                : std::ssize(KnownTo(query, match)) >= options_.min_between_maps;
}

std::vector<KnownConstraints::Known> KnownConstraints::KnownTo(const KeyframeId& query,
                                                               const KeyframeId& match) const {
  const auto maps = std::minmax(query.map, match.map);
  std::vector<Known> known_to;
  if (const auto found = by_maps_.find(maps); found != by_maps_.end()) {
    for (const auto& [seq_a, known] : found->second) {
      const KeyframeId a{maps.first, known.seq_a}, b{maps.second, known.seq_b};
      if (RestsOn(query, match, known.query_is_a ? a : b)) {
        known_to.push_back(known);
      }
    }
  }
  return known_to;
}

void KnownConstraints::Save(ByteWriter* writer) const {
  writer->PutCount(by_maps_.size());
  for (const auto& [maps, constraints] : by_maps_) {
    writer->Put(maps.first);
    writer->Put(maps.second);
    writer->PutCount(constraints.size());
    for (const auto& [seq_a, known] : constraints) {
      writer->Put(known.seq_a);
      writer->Put(known.seq_b);
      writer->Put(known.query_is_a);
      writer->Put(known.sigma_m);
    }
  }
}

void KnownConstraints::Restore(ByteReader* reader) {
  by_maps_.clear();
  for (size_t left = reader->GetCount(1); left > 0; --left) {
    std::pair<MapId, MapId> maps;
    reader->Get(&maps.first);
    reader->Get(&maps.second);
    auto& constraints = by_maps_[maps];
    for (size_t i = reader->GetCount(1); i > 0; --i) {
      Known known;
      reader->Get(&known.seq_a);
      reader->Get(&known.seq_b);
      reader->Get(&known.query_is_a);
      reader->Get(&known.sigma_m);
      constraints.emplace(known.seq_a, known);
    }
  }
}

KnownConstraints::Nearby KnownConstraints::NearbyOf(const KeyframeId& query,
                                                    const KeyframeId& match,
                                                    const KeyframeStore& store) const {
  const auto [a, b] = std::minmax(query, match);
  std::vector<double> sigmas;
  double known = 0;
  for (const Known& near : KnownTo(query, match)) {
    if (std::abs(near.seq_a - a.seq) > kMaxSeqDistance ||
        std::abs(near.seq_b - b.seq) > kMaxSeqDistance) {
      continue;
    }
    const auto path_a = PathBetween(a.map, a.seq, near.seq_a, store);
    const auto path_b = PathBetween(b.map, b.seq, near.seq_b, store);
    if (path_a && path_b) {
      const double drift_m = kDriftPerM * (*path_a + *path_b);
      known += 1 / (near.sigma_m * near.sigma_m + drift_m * drift_m);
      sigmas.push_back(near.sigma_m);
    }
  }
  if (sigmas.empty()) {
    return {0, std::numeric_limits<double>::infinity()};
  }
  const int count = static_cast<int>(sigmas.size());
  const double sigma = Median(std::move(sigmas));
  return {count, 0.5 * std::log2(1 + 1 / (sigma * sigma * known))};
}

}  // namespace pangea
