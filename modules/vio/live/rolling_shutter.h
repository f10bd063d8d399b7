#pragma once

// A keyframe as a global shutter would have taken it at the image's time: what a rolling shutter
// saw later, row by row, with the camera's motion during read-out taken out. Consumers of a
// keyframe then need not know of rows.

#include "core/keyframe.h"
#include "vio/imu/body_motion.h"

namespace pangea::vio {

// Moves corners (map points by their depth, all others by the depths of the map points around
// them) and the points' depths, by the body's motion from the image's time on.
// Corners that leave the image stay as they are. Does nothing for a global shutter.
void CompensateRollingShutter(const BodyMotion& motion, Keyframe& keyframe);

}  // namespace pangea::vio
