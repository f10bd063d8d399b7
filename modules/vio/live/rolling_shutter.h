#pragma once

// Compensates the rolling shutter of a keyframe: moves its corners to where a global shutter would
// have seen them at the image's time, so that users of keyframes need no model of rows.

#include "core/keyframe.h"
#include "vio/imu/body_motion.h"

namespace pangea::vio {

// Moves the corners, those of tags too, and the map points' depths by the body's motion after the
// image's time. A map point uses its own depth, any other corner the median depth of the map points
// around it. A corner that would leave the image is not moved. Does nothing for a global shutter.
void CompensateRollingShutter(const BodyMotion& motion, Keyframe& keyframe);

}  // namespace pangea::vio
