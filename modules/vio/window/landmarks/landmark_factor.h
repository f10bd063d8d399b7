#pragma once

// The term of one landmark's rays in the window's cost, with the landmark eliminated (Schur
// complement; docs/maths_vio.md). The loss is Huber's (1964).

#include "vio/window/window_problem.h"

namespace pangea::vio {

// Adds the term to cost, gradient and the upper triangle of H, and appends the elimination.
// `damping`: Levenberg-Marquardt damping of the landmark.
void AddLandmark(RowViews& rows, const Landmark& landmark, double damping, NormalEquations* out);

// The elimination alone.
NormalEquations::Elimination EliminateLandmark(RowViews& rows, const Landmark& landmark);

// The cost alone.
double LandmarkCost(RowViews& rows, const Landmark& landmark);

// Whitened distance between a ray and its prediction; infinite for a point behind the camera.
double RayError(RowViews& rows, const Eigen::Vector3d& p_odom, const FrameRay& seen);

}  // namespace pangea::vio
