#pragma once

// Rotations whose axes are axes of the other frame: what a convention of axes can get wrong.

#include <Eigen/Geometry>
#include <string>
#include <vector>

namespace pangea {

// All 24 of them, camera to body.
std::vector<Eigen::Quaterniond> AxisAlignedRotations();
Eigen::Quaterniond NearestAxisAligned(const Eigen::Quaterniond& q_body_cam);
// The body axes to which the image's right, its down and the optical axis point, by the nearest of
// these rotations: "-y,-x,-z".
std::string AxesOf(const Eigen::Quaterniond& q_body_cam);

}  // namespace pangea
