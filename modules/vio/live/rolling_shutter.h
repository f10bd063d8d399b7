#pragma once

// A keyframe as a global shutter would have taken it at the image's time: what a rolling shutter
// saw later, row by row, with the camera's motion during read-out taken out. Consumers of a
// keyframe then need not know of rows.

#include <Eigen/Core>

#include "core/keyframe.h"

namespace pangea::vio {

// The body's motion while the image was read out, in the body frame.
struct BodyMotion {
  Eigen::Vector3d omega = Eigen::Vector3d::Zero();  // rad/s
  Eigen::Vector3d v = Eigen::Vector3d::Zero();      // m/s
};

// Moves corners (map points by their depth, all others as if far away) and the points' depths.
// Corners that leave the image stay as they are. Does nothing for a global shutter.
void TakeOutReadout(const BodyMotion& motion, Keyframe& keyframe);

}  // namespace pangea::vio
