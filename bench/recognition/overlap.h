#pragma once

// How much two keyframes truly see of the same, from ground truth.
//
// A keyframe's map points (its corners with a depth) are placed by its true pose. Such a point is
// seen from another keyframe if it falls into its image, from a direction no more than 45 degrees
// from where the first saw it, at half to twice the distance: further apart no descriptor is meant
// to match. The overlap of two keyframes is the mean of the two shares of points that the other
// sees. Walls in between are not looked for.

#include <Eigen/Core>
#include <vector>

#include "core/keyframe.h"

namespace pangea::bench {

// From here on a place is the right one.
inline constexpr double kRightOverlap = 0.25;

// What a keyframe sees, in the ground truth's frame.
struct View {
  CameraModel camera;
  Rigid3 T_reference_cam;
  std::vector<Eigen::Vector3d> p_reference;  // its map points
};
View ViewOf(const Keyframe& keyframe, const Rigid3& T_reference_body);

// 0 .. 1.
double Overlap(const View& a, const View& b);

}  // namespace pangea::bench
