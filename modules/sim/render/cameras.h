#pragma once

// The cameras of rendered recordings.

#include "core/camera_model.h"

namespace pangea::sim {

// EuRoC's cam0.
CameraModel EurocCamera();
// A phone's wide camera: equidistant lens, rolling shutter.
CameraModel PhoneCamera();
// A fisheye with a view of more than 90 degrees from the axis: TUM-VI's cam0 at 512 x 512.
CameraModel WideCamera();
// The same camera with its image, and all values in pixels, divided by `factor`.
CameraModel Shrunk(const CameraModel& camera, double factor);

}  // namespace pangea::sim
