#pragma once

// A camera in a lift or a vehicle sees its cabin, which does not move relative to it; the IMU
// measures the accelerations of the cabin. If an IMU factor contradicts the images by more than
// noise explains, an unknown acceleration is added to its covariance. The odometry is then relative
// to the cabin.

#include "vio/window/window_problem.h"

namespace pangea::vio {

// Checks the IMU factors of an optimised window. Returns true if one changed; then optimise again.
bool AllowForUnmodelledAcceleration(WindowProblem* problem);

}  // namespace pangea::vio
