#include "loop_verification/known_constraints.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "core/median.h"

namespace pangea {
namespace {

double WorstSigma(const Matrix6d& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance.topLeftCorner<3, 3>(),
                                                              Eigen::EigenvaluesOnly);
  return std::sqrt(solver.eigenvalues().maxCoeff());
}

// Of two keyframes of one map.
std::optional<double> PathBetween(const MapId& map, int32_t a, int32_t b,
                                  const SubmapStore& store) {
  return store.PathBetween({map, std::min(a, b)}, {map, std::max(a, b)});
}

}  // namespace

void KnownConstraints::Add(const Constraint& constraint) {
  const auto [a, b] = std::minmax(constraint.from, constraint.to);
  by_maps_[{a.map, b.map}].insert({a.seq, {a.seq, b.seq, WorstSigma(constraint.covariance)}});
}

bool KnownConstraints::IsRedundant(const KeyframeId& a, const KeyframeId& b,
                                   const SubmapStore& store) const {
  const Nearby nearby = NearbyOf(a, b, store);
  if (nearby.gain_bits >= options_.min_gain_bits) {
    return false;
  }
  return a.map == b.map ? nearby.count >= options_.min_nearby
                        : NumBetween(a.map, b.map) >= options_.min_between_maps;
}

int KnownConstraints::NumBetween(const MapId& a, const MapId& b) const {
  const auto found = by_maps_.find(std::minmax(a, b));
  return found == by_maps_.end() ? 0 : static_cast<int>(found->second.size());
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
      reader->Get(&known.sigma_m);
      constraints.emplace(known.seq_a, known);
    }
  }
}

KnownConstraints::Nearby KnownConstraints::NearbyOf(const KeyframeId& one, const KeyframeId& other,
                                                    const SubmapStore& store) const {
  const auto [a, b] = std::minmax(one, other);
  const auto found = by_maps_.find({a.map, b.map});
  std::vector<double> sigmas;
  double known = 0;
  if (found != by_maps_.end()) {
    const auto end = found->second.upper_bound(a.seq + kMaxSeqDistance);
    for (auto it = found->second.lower_bound(a.seq - kMaxSeqDistance); it != end; ++it) {
      const Known& near = it->second;
      if (std::abs(near.seq_b - b.seq) > kMaxSeqDistance) {
        continue;
      }
      const auto path_a = PathBetween(a.map, a.seq, near.seq_a, store);
      const auto path_b = PathBetween(b.map, b.seq, near.seq_b, store);
      if (path_a && path_b) {
        const double drift_m = options_.drift_per_m * (*path_a + *path_b);
        known += 1 / (near.sigma_m * near.sigma_m + drift_m * drift_m);
        sigmas.push_back(near.sigma_m);
      }
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
