#include "anchors/surface.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "core/median.h"

namespace pangea {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr size_t kMinPoints = 3;
constexpr size_t kMaxPoints = 12;
constexpr double kMaxDistance = 0.25;  // between rays, on z = 1: about 14 degrees
// The variogram: the relative inverse depths of two rays differ by kRoughness * d^(kExponent / 2),
// one sigma, at a distance d. An exponent of 2 is a smooth surface, 1 one with steps everywhere.
constexpr double kRoughness = 0.8;
constexpr double kExponent = 1.5;
// How many points kRoughness counts for, against the roughness that the points themselves show.
constexpr double kPriorPoints = 8;
constexpr double kOutlier = 2;  // standardised residual of a point
constexpr int kIterations = 2;
constexpr double kMaxChi2 = 16;  // of a single point, in the estimate of the roughness
constexpr double kMinRelativeSigma = 1e-6;
constexpr double kMaxRelativeSigma = 0.15;

struct Kriging {
  VectorXd inverse_depth;
  VectorXd variance;      // of each inverse depth
  VectorXd distance;      // to the ray
  VectorXd semivariance;  // to the ray
  MatrixXd semivariances;
};

Kriging Prepare(const Eigen::Vector2d& ray, const std::vector<SurfacePoint>& points) {
  const auto count = static_cast<Eigen::Index>(points.size());
  Kriging kriging{VectorXd(count), VectorXd(count), VectorXd(count), {}, MatrixXd(count, count)};
  for (Eigen::Index i = 0; i < count; ++i) {
    kriging.inverse_depth[i] = points[static_cast<size_t>(i)].inverse_depth;
    kriging.distance[i] = (points[static_cast<size_t>(i)].ray - ray).norm();
    for (Eigen::Index j = 0; j < count; ++j) {
      kriging.semivariances(i, j) =
          (points[static_cast<size_t>(i)].ray - points[static_cast<size_t>(j)].ray).norm();
    }
  }
  const double scale =
      Median(std::vector<double>(kriging.inverse_depth.begin(), kriging.inverse_depth.end()));
  for (Eigen::Index i = 0; i < count; ++i) {
    const double sigma = std::max(points[static_cast<size_t>(i)].sigma, kMinRelativeSigma * scale);
    kriging.variance[i] = sigma * sigma;
  }
  const double half_square = 0.5 * std::pow(kRoughness * scale, 2);
  kriging.semivariance = half_square * kriging.distance.array().pow(kExponent);
  kriging.semivariances = half_square * kriging.semivariances.array().pow(kExponent);
  return kriging;
}

// Inverse of the equations of ordinary kriging (Cressie, Statistics for Spatial Data, 1993, section
// 3.2); the last row is the condition that the weights add up to 1.
MatrixXd InverseOfEquations(const Kriging& kriging) {
  const Eigen::Index count = kriging.variance.size();
  MatrixXd equations = MatrixXd::Ones(count + 1, count + 1);
  equations.topLeftCorner(count, count) = -kriging.semivariances;
  equations.topLeftCorner(count, count).diagonal() += kriging.variance;
  equations(count, count) = 0;
  return equations.inverse();
}

// Each point is predicted from the others (Dubrule, Mathematical Geology 1983). What the residuals
// show scales the roughness, with more weight near the ray; points far off get a larger variance.
void LearnFromResiduals(const VectorXd& variance, Kriging* kriging) {
  const Eigen::Index count = variance.size();
  const MatrixXd inverse = InverseOfEquations(*kriging).topLeftCorner(count, count);
  const Eigen::ArrayXd information = inverse.diagonal().array().max(1e-300);
  const Eigen::ArrayXd residual = (inverse * kriging->inverse_depth).array() / information;
  const Eigen::ArrayXd chi2 = residual.square() * information;
  const Eigen::ArrayXd weight =
      1 / (1 + kriging->distance.array() / std::max(kriging->distance.mean(), 1e-9));
  const double mean = (weight * chi2.min(kMaxChi2)).sum() / weight.sum();
  const double factor = (mean * static_cast<double>(count) + kPriorPoints) /
                        (static_cast<double>(count) + kPriorPoints);
  kriging->semivariance *= factor;
  kriging->semivariances *= factor;
  for (Eigen::Index i = 0; i < count; ++i) {
    const bool outlier = chi2[i] > kOutlier * kOutlier;
    kriging->variance[i] =
        variance[i] + (outlier ? residual[i] * residual[i] / (kOutlier * kOutlier) : 0.0);
  }
}

}  // namespace

std::optional<SurfaceDepth> DepthBehind(const Eigen::Vector2d& ray,
                                        std::vector<SurfacePoint> points) {
  const auto distance = [&ray](const SurfacePoint& point) { return (point.ray - ray).norm(); };
  std::erase_if(points, [&](const SurfacePoint& point) { return distance(point) > kMaxDistance; });
  if (points.size() < kMinPoints) {
    return std::nullopt;
  }
  std::ranges::stable_sort(points, {}, distance);
  points.resize(std::min(points.size(), kMaxPoints));
  Kriging kriging = Prepare(ray, points);
  const VectorXd variance = kriging.variance;
  for (int i = 0; i < kIterations; ++i) {
    LearnFromResiduals(variance, &kriging);
  }
  VectorXd right(variance.size() + 1);
  right << -kriging.semivariance, 1;
  const VectorXd weights = (InverseOfEquations(kriging) * right).head(variance.size());
  const double inverse_depth = weights.dot(kriging.inverse_depth);
  const double sigma = std::sqrt(std::max(
      0.0, 2 * weights.dot(kriging.semivariance) - weights.dot(kriging.semivariances * weights) +
               weights.dot(kriging.variance.cwiseProduct(weights))));
  if (!(inverse_depth > 0) || !(sigma < kMaxRelativeSigma * inverse_depth)) {
    return std::nullopt;
  }
  return SurfaceDepth{1 / inverse_depth, sigma / (inverse_depth * inverse_depth)};
}

}  // namespace pangea
