#pragma once

// The terms of the window's cost other than landmarks (landmark_factor.h). Each function adds one
// to the normal equations (docs/maths_vio.md). No term changes if all frames are shifted, or
// rotated about the vertical, together.

#include "vio/window/window_problem.h"

namespace pangea::vio {

// The inertial measurement between frames to - 1 and to. Fills only the upper triangle of H.
void AddImuFactor(const WindowState& state, const ImuFactor& factor, int to, NormalEquations* out);
// The velocity of a stationary frame is zero.
inline constexpr double kStationaryVelocitySigma = 0.02;  // m/s
void AddZeroVelocityUpdate(const WindowState& state, int frame, NormalEquations* out);
// Two stationary neighbours have the same pose: r = (Log(R_i^T R_j), R_i^T (p_j - p_i)).
bool StationaryTogether(const WindowProblem& problem, int to);
void AddZeroMotionUpdate(const WindowState& state, int to, NormalEquations* out);
// The prior of a stamp's error: zero mean, stamp_sigma_s.
void AddStampError(const WindowState& state, int frame, NormalEquations* out);
void AddPrior(const WindowProblem& problem, NormalEquations* out);

// The sum of all terms, landmarks included, without derivatives.
double Cost(const WindowProblem& problem);

}  // namespace pangea::vio
