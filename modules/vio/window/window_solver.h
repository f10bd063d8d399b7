#pragma once

// Solves the window's normal equations using their structure. Velocity and biases of a frame are
// connected only to its neighbours (IMU factors); only those of the oldest frame are connected to
// more (the prior). They are eliminated first, newest frame first: each elimination then fills in
// only the next older frame's, and, of the remaining rows, those of the frames already passed. The
// remaining system is half as large, and dense.

#include <Eigen/Core>
#include <vector>

#include "vio/window/window_state.h"

namespace pangea::vio {

// The remaining rows: calibration, poses and stamps; newest frame first.
std::vector<int> RowsOfPoses(const WindowState& state);

// The solution x of H x = b, H symmetric and positive semidefinite. b may have several columns.
Eigen::MatrixXd SolveWindow(const WindowState& state, const Eigen::MatrixXd& H,
                            const Eigen::MatrixXd& b);

}  // namespace pangea::vio
