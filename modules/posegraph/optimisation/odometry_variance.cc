#include "posegraph/optimisation/odometry_variance.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <utility>

#include "core/median.h"

namespace pangea {
namespace {

constexpr double kMeanChi2 = 4;  // chi-squared with four degrees of freedom
constexpr double kMaxVarianceFactor = 1e4;
constexpr size_t kMaxInnovations = 200;

double MedianDistance(const std::vector<PairEvidence::Innovation>& innovations, double factor) {
  std::vector<double> distances;
  for (const auto& [error, measurement, odometry] : innovations) {
    const Matrix4d covariance = measurement + factor * odometry;
    distances.push_back(error.dot(covariance.ldlt().solve(error)));
  }
  return Median(std::move(distances));
}

// Odometry's prediction minus the measurement, for a loop within a map.
Vector4d ErrorOf(const Loop& loop, const OdometryChain& chain) {
  return Residual({chain[loop.from.node].T_odom_body.t, 0}, {chain[loop.to.node].T_odom_body.t, 0},
                  loop.relative);
}

}  // namespace

bool FitsOdometry(const Loop& loop, const OdometryChain& chain) {
  const Vector4d error = ErrorOf(loop, chain);
  const Matrix4d covariance =
      loop.relative.covariance +
      BelievableDrift(chain, loop.from.node, loop.to.node, chain[loop.to.node].T_odom_body.t);
  return error.dot(covariance.ldlt().solve(error)) <= kMaxLoopChi2;
}

std::vector<PairEvidence::Innovation> Innovations(const std::vector<const Loop*>& loops,
                                                  const std::vector<const MapPair*>& pairs,
                                                  const GraphMaps& maps) {
  std::vector<PairEvidence::Innovation> innovations;
  for (const Loop* loop : loops) {
    const OdometryChain& chain = maps[loop->from.map].chain;
    if (loop->intra() && FitsOdometry(*loop, chain)) {
      innovations.push_back(
          {ErrorOf(*loop, chain), loop->relative.covariance,
           chain.DriftBetween(loop->from.node, loop->to.node, chain[loop->to.node].T_odom_body.t)});
    }
  }
  for (const MapPair* pair : pairs) {
    if (pair->evidence.decision().merge) {
      const auto more = pair->evidence.Innovations();
      innovations.insert(innovations.end(), more.begin(), more.end());
    }
  }
  std::vector<PairEvidence::Innovation> some;
  const size_t stride = 1 + innovations.size() / kMaxInnovations;
  for (size_t i = 0; i < innovations.size(); i += stride) {
    some.push_back(innovations[i]);
  }
  return some;
}

double OdometryVariance(const std::vector<PairEvidence::Innovation>& innovations) {
  // Loops at one place share one drift, so the median counts as a single sample, and the most
  // likely factor brings it to its mean. The factor has no jump, or one constraint could decide the
  // shape of the map.
  if (innovations.empty() || MedianDistance(innovations, 1) < kMeanChi2) {
    return 1;
  }
  double low = 0, high = std::log(kMaxVarianceFactor);
  constexpr int kBisections = 20;
  for (int i = 0; i < kBisections; ++i) {
    const double middle = 0.5 * (low + high);
    (MedianDistance(innovations, std::exp(middle)) > kMeanChi2 ? low : high) = middle;
  }
  return std::exp(high);
}

}  // namespace pangea
