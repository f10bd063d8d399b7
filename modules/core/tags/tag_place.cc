#include "core/tags/tag_place.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <array>
#include <cmath>

namespace pangea {
namespace {

// Of a ray, radians: of the corners, and of the odometry between the views.
constexpr double kRaySigma = 0.003;
// Least eigenvalue of A: the sum of the squared sines of the angles between the rays.
constexpr double kMinParallax = 0.002;

}  // namespace

void TagRays::Add(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) {
  const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - direction * direction.transpose();
  A_ += across;
  b_ += across * origin;
  sum_of_origins_ += origin;
  ++count_;
}

std::optional<TagPlace> TagRays::Place() const {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(A_);
  const double parallax = eigen.eigenvalues()[0];
  if (count_ < 2 || !(parallax > kMinParallax)) {
    return std::nullopt;
  }
  TagPlace place;
  place.p = A_.inverse() * b_;
  const double distance = (place.p - sum_of_origins_ / count_).norm();
  place.sigma_m = kRaySigma * distance / std::sqrt(parallax);
  return place;
}

std::optional<Eigen::Vector3d> DirectionTo(const TagObservation& tag, const CameraModel& camera) {
  std::array<Eigen::Vector3d, kTagCorners> rays;
  for (size_t i = 0; i < rays.size(); ++i) {
    const auto xy = camera.Unproject(tag.corners[i].cast<double>());
    if (!xy) {
      return std::nullopt;
    }
    rays[i] = {xy->x(), xy->y(), 1};
  }
  // Where the diagonals meet.
  const Eigen::Vector3d centre = rays[0].cross(rays[2]).cross(rays[1].cross(rays[3]));
  return (centre.z() < 0 ? -centre : centre).normalized();
}

}  // namespace pangea
