#include "loop_verification/tags/planar_pose.h"

#include <Eigen/LU>
#include <cmath>

#include "core/nearest_rotation.h"

namespace pangea {
namespace {

// The homography from the square's corners (+-1, +-1) to the rays, with H(2, 2) = 1: the square's
// centre is before the camera.
Eigen::Matrix3d HomographyTo(const std::array<Eigen::Vector2d, kTagCorners>& rays) {
  Eigen::Matrix<double, 8, 8> A = Eigen::Matrix<double, 8, 8>::Zero();
  Eigen::Matrix<double, 8, 1> b;
  for (int i = 0; i < kTagCorners; ++i) {
    const auto& [x, y] = kTagCornerSigns[static_cast<size_t>(i)];
    const Eigen::Vector2d& ray = rays[static_cast<size_t>(i)];
    A.row(2 * i) << x, y, 1, 0, 0, 0, -ray.x() * x, -ray.x() * y;
    A.row(2 * i + 1) << 0, 0, 0, x, y, 1, -ray.y() * x, -ray.y() * y;
    b.segment<2>(2 * i) = ray;
  }
  const Eigen::Matrix<double, 8, 1> h = A.fullPivLu().solve(b);
  Eigen::Matrix3d H;
  H << h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], 1;
  return H;
}

}  // namespace

std::vector<Rigid3> PosesOfSquare(const std::array<Eigen::Vector2d, kTagCorners>& rays) {
  const Eigen::Matrix3d H = HomographyTo(rays);
  const double scale = 2 / (H.col(0).norm() + H.col(1).norm());
  if (!std::isfinite(scale) || scale <= 0) {
    return {};
  }
  Eigen::Matrix3d R;
  R << scale * H.col(0), scale * H.col(1), (scale * scale * H.col(0)).cross(H.col(1));
  R = NearestRotation(R);
  const Eigen::Vector3d t = scale * H.col(2);
  // Mirrored at the plane through the tag that the line of sight is normal to.
  const Eigen::Vector3d sight = t.normalized();
  const Eigen::Matrix3d mirror = Eigen::Matrix3d::Identity() - 2 * sight * sight.transpose();
  const Eigen::Matrix3d other = mirror * R * Eigen::Vector3d(1, 1, -1).asDiagonal();
  return {{Eigen::Quaterniond(R), t}, {Eigen::Quaterniond(other), t}};
}

}  // namespace pangea
