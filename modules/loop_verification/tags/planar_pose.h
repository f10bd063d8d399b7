#pragma once

// The pose of a square from the rays to its corners.
//
// A small or distant square has two poses that fit nearly as well: the second one is tilted to the
// other side of the line of sight (Schweighofer & Pinz, PAMI 2006).

#include <Eigen/Core>
#include <array>
#include <vector>

#include "core/rigid3.h"
#include "core/tags/tag.h"

namespace pangea {

// Both poses T_cam_tag, in units of half of the square's side. `rays`: of the corners, z = 1.
// Empty if the rays are those of no square.
std::vector<Rigid3> PosesOfSquare(const std::array<Eigen::Vector2d, kTagCorners>& rays);

}  // namespace pangea
