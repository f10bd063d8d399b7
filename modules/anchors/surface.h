#pragma once

// How far away the surface is that a pixel shows, from the points of a map around that pixel.

#include <Eigen/Core>
#include <optional>
#include <vector>

namespace pangea {

// In the frame of one camera; `ray` is (x, y) on the plane z = 1.
struct SurfacePoint {
  Eigen::Vector2d ray;
  double inverse_depth = 0;  // 1/m, along z
  double sigma = 0;          // of the inverse depth
};

struct SurfaceDepth {
  double depth_m = 0;  // along z
  double sigma_m = 0;
};

// The inverse depth of a plane is linear in the ray, so a plane is fitted to the nearest points,
// robustly, and the more freely the better they surround the ray. Nothing where there are not
// enough points close by, or they do not agree to a tenth.
std::optional<SurfaceDepth> DepthBehind(const Eigen::Vector2d& ray,
                                        std::vector<SurfacePoint> points);

}  // namespace pangea
