#pragma once

// A camera in a lift or a vehicle sees its cabin, which stands still; the IMU feels how the cabin
// starts and stops. An IMU factor that contradicts the images by more than noise can is then taken
// with an acceleration that nothing else tells of, and the odometry is that in the cabin.

#include "vio/window/window_problem.h"

namespace pangea::vio {

// Looks at the IMU factors of an optimised window. Whether one changed: then optimise it again.
bool AllowForUnmodelledAcceleration(WindowProblem* problem);

}  // namespace pangea::vio
