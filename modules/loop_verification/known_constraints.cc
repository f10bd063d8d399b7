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

// Where third maps connect two maps, smaller position differences do not count: half of what an
// anchor may be off (bench/README.md).
constexpr double kTolerance_m = 0.01;

// Path length between two keyframes of one map, m.
std::optional<double> PathBetween(const MapId& map, int32_t a, int32_t b,
                                  const KeyframeStore& store) {
  return store.PathBetween({map, std::min(a, b)}, {map, std::max(a, b)});
}

}  // namespace

void KnownConstraints::Add(const Constraint& constraint) {
  const auto [a, b] = std::minmax(constraint.from, constraint.to);
  NoteNeighbours(a.map, b.map);
  by_maps_[{a.map, b.map}].insert({a.seq,
                                   {a.seq, b.seq, a == constraint.to,
                                    LargestSigma(constraint.covariance.topLeftCorner<3, 3>())}});
}

bool KnownConstraints::IsRedundant(const KeyframeId& query, const KeyframeId& match,
                                   const KeyframeStore& store) const {
  const bool of_one_map = query.map == match.map;
  if (!of_one_map && !ManyBetweenMaps(query, match)) {
    return false;
  }
  const Nearby nearby = NearbyOf(query, match, store);
  return nearby.gain_bits < options_.min_gain_bits &&
         (!of_one_map || nearby.count >= options_.min_nearby);
}

void KnownConstraints::NoteNeighbours(const MapId& a, const MapId& b) {
  if (a != b) {
    neighbours_[a].insert(b);
    neighbours_[b].insert(a);
  }
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
  neighbours_.clear();
  for (size_t left = reader->GetCount(1); left > 0; --left) {
    std::pair<MapId, MapId> maps;
    reader->Get(&maps.first);
    reader->Get(&maps.second);
    NoteNeighbours(maps.first, maps.second);
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

KnownConstraints::Knowledge KnownConstraints::KnowledgeOf(const KeyframeId& query,
                                                          const KeyframeId& match,
                                                          const KeyframeStore& store) const {
  Knowledge knowledge;
  const BySeq* const between = Between(query, match);
  if (between == nullptr) {
    return knowledge;
  }
  const auto [a, b] = std::minmax(query, match);
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
      knowledge.information += 1 / (near.sigma_m * near.sigma_m + drift_m * drift_m);
      knowledge.sigmas.push_back(near.sigma_m);
    }
  }
  return knowledge;
}

std::optional<KeyframeId> KnownConstraints::LastMatchIn(const MapId& third,
                                                        const KeyframeId& query) const {
  const bool query_is_a = query.map < third;
  std::pair<int32_t, int32_t> last(query.seq - kMaxSeqDistance - 1, -1);  // seqs of query and match
  for (const auto& [seq_a, known] : *Between(query, {third, 0})) {
    if (known.query_is_a == query_is_a) {
      const auto seqs =
          query_is_a ? std::pair(known.seq_a, known.seq_b) : std::pair(known.seq_b, known.seq_a);
      last = seqs.first < query.seq ? std::max(last, seqs) : last;
    }
  }
  return last.second < 0 ? std::nullopt : std::optional(KeyframeId{third, last.second});
}

std::vector<KeyframeId> KnownConstraints::WaysThroughThirdMaps(const KeyframeId& query,
                                                               const KeyframeId& match) const {
  std::vector<KeyframeId> ways;
  const auto neighbours = neighbours_.find(query.map);
  if (neighbours != neighbours_.end()) {
    for (const MapId& third : neighbours->second) {
      const auto via = third == match.map ? std::nullopt : LastMatchIn(third, query);
      if (via) {
        ways.push_back(*via);
      }
    }
  }
  return ways;
}

KnownConstraints::Nearby KnownConstraints::NearbyOf(const KeyframeId& query,
                                                    const KeyframeId& match,
                                                    const KeyframeStore& store) const {
  Knowledge all = KnowledgeOf(query, match, store);
  const int count = static_cast<int>(all.sigmas.size());
  double tolerance_m = 0;
  for (const KeyframeId& via : WaysThroughThirdMaps(query, match)) {
    const Knowledge near = KnowledgeOf(query, via, store);
    const Knowledge far = KnowledgeOf(match, via, store);
    if (near.information > 0 && far.information > 0) {
      all.information += 1 / (1 / near.information + 1 / far.information);
      all.sigmas.insert(all.sigmas.end(), near.sigmas.begin(), near.sigmas.end());
      all.sigmas.insert(all.sigmas.end(), far.sigmas.begin(), far.sigmas.end());
      tolerance_m = kTolerance_m;
    }
  }
  if (all.sigmas.empty()) {
    return {0, std::numeric_limits<double>::infinity()};
  }
  const double sigma = Median(std::move(all.sigmas));
  const auto variance = [tolerance_m](double information) {
    return 1 / information + tolerance_m * tolerance_m;
  };
  const double after = all.information + 1 / (sigma * sigma);
  return {count, 0.5 * std::log2(variance(all.information) / variance(after))};
}

}  // namespace pangea
