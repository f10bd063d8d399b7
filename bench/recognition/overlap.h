#pragma once

// Computes, from ground truth, how much the views of two keyframes overlap.
//
// A keyframe's map points (corners with a depth) are placed by its true pose. Another keyframe sees
// such a point if it projects into the image, at an angle of at most 45 degrees to the first line
// of sight, and at half to twice the distance: beyond that, descriptors are not expected to match.
// The overlap of two keyframes is the mean of the two shares of points that the other one sees.
// Occlusion by walls is not considered.

#include <Eigen/Core>
#include <vector>

#include "core/keyframe.h"

namespace pangea::bench {

// A candidate is right if the overlap is at least this.
inline constexpr double kRightOverlap = 0.25;

// The view of a keyframe, in the ground truth's frame.
struct View {
  CameraModel camera;
  Rigid3 T_reference_cam;
  std::vector<Eigen::Vector3d> p_reference;  // its map points
};
View ViewOf(const Keyframe& keyframe, const Rigid3& T_reference_body);

// 0 .. 1.
double Overlap(const View& a, const View& b);

}  // namespace pangea::bench
