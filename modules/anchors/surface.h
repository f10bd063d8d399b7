#pragma once

// Estimates the distance of the surface behind a pixel from the map points around it.

#include <Eigen/Core>
#include <optional>
#include <vector>

namespace pangea {

// A map point in the camera frame; `ray` is (x, y) on the plane z = 1.
struct SurfacePoint {
  Eigen::Vector2d ray;
  double inverse_depth = 0;  // 1/m, along z
  double sigma = 0;          // of the inverse depth
};

struct SurfaceDepth {
  double depth_m = 0;  // along z
  double sigma_m = 0;
};

// Interpolates the inverse depths of the nearest points by robust kriging: points say less the
// farther they are from the ray, and how rough the surface is follows from how well they predict
// each other. Empty if there are too few points nearby, or if the relative sigma is above 0.15.
std::optional<SurfaceDepth> DepthBehind(const Eigen::Vector2d& ray,
                                        std::vector<SurfacePoint> points);

}  // namespace pangea
