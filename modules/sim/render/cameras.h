#pragma once

// The cameras recordings are made with.

#include "core/camera_model.h"

namespace pangea::sim {

// EuRoC's cam0.
CameraModel EurocCamera();
// A phone's wide camera: equidistant lens, rolling shutter.
CameraModel PhoneCamera();
// A fisheye whose picture reaches beyond 90 degrees from the axis: TUM-VI's cam0 at 512 x 512.
CameraModel WideCamera();
// The same camera with its image, and all that is in pixels, shrunk by a factor.
CameraModel Shrunk(const CameraModel& camera, double factor);

}  // namespace pangea::sim
