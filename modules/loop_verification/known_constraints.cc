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
                                : ManyBetweenMaps(query, match);
}

const KnownConstraints::BySeq* KnownConstraints::Between(const KeyframeId& query,
                                                         const KeyframeId& match) const {
  const auto found = by_maps_.find(std::minmax(query.map, match.map));
  return found == by_maps_.end() ? nullptr : &found->second;
}

bool KnownConstraints::Precedes(const Known& known, const KeyframeId& query,
                                const KeyframeId& match) {
  const auto [a, b] = std::minmax(query, match);
  return RestsOn(
      query, match,
      known.query_is_a ? KeyframeId{a.map, known.seq_a} : KeyframeId{b.map, known.seq_b});
}

bool KnownConstraints::ManyBetweenMaps(const KeyframeId& query, const KeyframeId& match) const {
  const BySeq* const between = Between(query, match);
  int count = 0;
  if (between != nullptr) {
    for (auto it = between->begin(); it != between->end() && count < options_.min_between_maps;
         ++it) {
      count += Precedes(it->second, query, match) ? 1 : 0;
    }
  }
  return count >= options_.min_between_maps;
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
  const BySeq* const between = Between(query, match);
  if (between == nullptr) {
    return {0, std::numeric_limits<double>::infinity()};
  }
  const auto [a, b] = std::minmax(query, match);
  std::vector<double> sigmas;
  double known = 0;
  const auto end = between->upper_bound(a.seq + kMaxSeqDistance);
  for (auto it = between->lower_bound(a.seq - kMaxSeqDistance); it != end; ++it) {
    const Known& near = it->second;
    if (std::abs(near.seq_b - b.seq) > kMaxSeqDistance || !Precedes(near, query, match)) {
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
