#pragma once

// The rays of one landmark in the window's cost, the landmark eliminated (Schur complement;
// docs/maths_vio.md). Rays that are far off pull with constant force (Huber, 1964).

#include "vio/window/window_problem.h"

namespace pangea::vio {

// Adds to cost and gradient, and to the upper triangle of H; appends the elimination. `damping`:
// Levenberg-Marquardt's, of the landmark.
void AddLandmark(RowViews& rows, const Landmark& landmark, double damping, NormalEquations* out);

// The elimination alone.
NormalEquations::Elimination EliminateLandmark(RowViews& rows, const Landmark& landmark);

// The cost alone.
double LandmarkCost(RowViews& rows, const Landmark& landmark);

// Whitened distance of a ray from where it should be; infinite for a point behind the camera.
double RayError(RowViews& rows, const Eigen::Vector3d& p_odom, const FrameRay& seen);

}  // namespace pangea::vio
