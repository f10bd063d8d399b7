#pragma once

// The terms of the window's cost beside its landmarks (landmark_factor.h), each added to the normal
// equations with its derivatives (docs/maths_vio.md). None of them changes when all frames are
// shifted together, or rotated together about the vertical.

#include "vio/window/window_problem.h"

namespace pangea::vio {

// The inertial measurement between frames to - 1 and to. In H the upper triangle.
void AddImuFactor(const WindowState& state, const ImuFactor& factor, int to, NormalEquations* out);
// The velocity of a stationary frame is zero.
inline constexpr double kStationaryVelocitySigma = 0.02;  // m/s
void AddZeroVelocityUpdate(const WindowState& state, int frame, NormalEquations* out);
// Two neighbours that are both stationary have one pose: r = (Log(R_i^T R_j), R_i^T (p_j - p_i)).
bool StationaryTogether(const WindowProblem& problem, int to);
void AddZeroMotionUpdate(const WindowState& state, int to, NormalEquations* out);
// What is known of a stamp's error beforehand: nothing but its size.
void AddStampError(const WindowState& state, int frame, NormalEquations* out);
void AddPrior(const WindowProblem& problem, NormalEquations* out);

// The sum of them all and of the landmarks, without derivatives.
double Cost(const WindowProblem& problem);

}  // namespace pangea::vio
