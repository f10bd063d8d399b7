#pragma once

// Triangulation of a point from the rays of several views.

#include <Eigen/Core>
#include <optional>
#include <span>

namespace pangea {

struct LineOfSight {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  // of length 1
};

// The midpoint method for any number of views: the point with the least sum of squared distances
// to all lines. Nothing when the lines are parallel.
std::optional<Eigen::Vector3d> TriangulateMidpoint(std::span<const LineOfSight> lines);

}  // namespace pangea
