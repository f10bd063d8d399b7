#include "anchors/surface.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace pangea {
namespace {

constexpr size_t kMinPoints = 3;
constexpr size_t kMaxPoints = 12;
constexpr double kMaxDistance = 0.25;  // between rays, on z = 1: about 14 degrees
// A surface is not a plane: the weight of a point decreases with its distance from the ray.
// relative sigma of the inverse depth, per unit of distance between the rays
constexpr double kRelativeBend = 0.3;
// Prior sigma of the relative slope, for points that do not surround the ray.
constexpr double kRelativeSlope = 1.0;
constexpr double kHuber = 1.5;  // standard deviations
constexpr int kIterations = 10;
constexpr double kMaxRelativeSigma = 0.1;

struct Fit {
  double inverse_depth = 0;
  double sigma = 0;
};

Fit FitPlane(const Eigen::Vector2d& ray, const std::vector<SurfacePoint>& points) {
  double scale = 0;
  for (const SurfacePoint& point : points) {
    scale += point.inverse_depth / static_cast<double>(points.size());
  }
  Eigen::Vector3d x(scale, 0, 0);  // inverse depth at the ray, and its gradient
  Eigen::Matrix3d information;
  double squares = 0;
  for (int i = 0; i < kIterations; ++i) {
    const double slope_weight = 1 / std::pow(kRelativeSlope * scale, 2);
    information = Eigen::Vector3d(0, slope_weight, slope_weight).asDiagonal();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    squares = 0;
    for (const SurfacePoint& point : points) {
      const Eigen::Vector2d from_ray = point.ray - ray;
      const Eigen::Vector3d row(1, from_ray.x(), from_ray.y());
      const double sigma = std::hypot(point.sigma, kRelativeBend * scale * from_ray.norm());
      const double residual = (point.inverse_depth - row.dot(x)) / sigma;
      const double weight = std::min(1.0, kHuber / std::max(std::abs(residual), 1e-9));
      information += weight / (sigma * sigma) * row * row.transpose();
      right += weight / (sigma * sigma) * point.inverse_depth * row;
      squares += weight * residual * residual;
    }
    x = information.llt().solve(right);
  }
  const double variance = information.llt().solve(Eigen::Vector3d::UnitX()).x();
  const double scatter = std::max(1.0, squares / static_cast<double>(points.size()));
  return {x.x(), std::sqrt(variance * scatter)};
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
  const Fit fit = FitPlane(ray, points);
  if (!(fit.inverse_depth > 0) || !(fit.sigma < kMaxRelativeSigma * fit.inverse_depth)) {
    return std::nullopt;
  }
  return SurfaceDepth{1 / fit.inverse_depth, fit.sigma / (fit.inverse_depth * fit.inverse_depth)};
}

}  // namespace pangea
