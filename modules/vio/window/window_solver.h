#pragma once

// Solves the window's normal equations by their structure. Velocity and biases of a frame are tied
// to its neighbours alone (IMU factors), and only the oldest frame's to more (the prior). So they
// are eliminated first, newest frame first: each then meets the next older one's, and of the rest
// only what belongs to the frames passed so far. The rest is half as large, and dense.

#include <Eigen/Core>
#include <vector>

#include "vio/window/window_state.h"

namespace pangea::vio {

// The rest: rows of calibration, poses and stamps; newest frame first.
std::vector<int> RowsOfPoses(const WindowState& state);

// The solution x of H x = b, H symmetric and positive semidefinite. Columns of b are solved
// together.
Eigen::MatrixXd SolveWindow(const WindowState& state, const Eigen::MatrixXd& H,
                            const Eigen::MatrixXd& b);

}  // namespace pangea::vio
