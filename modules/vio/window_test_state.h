#pragma once

// A window to test on: a few camera poses in general position, landmarks all of them see.

#include <Eigen/Core>
#include <random>

#include "vio/window_state.h"

namespace pangea::vio {

Eigen::Vector3d RandomVector(std::mt19937_64& rng, double sigma);

// Landmark i is anchored in clone i % clones. The covariance is a random, well-conditioned one.
WindowState TestWindow(int clones, int landmarks, uint64_t seed);

// a (-) b in the coordinates of WindowState::Retract: b.Retract(Difference(a, b)) is a.
Eigen::VectorXd Difference(const WindowState& a, const WindowState& b);

// The four directions nobody observes, as columns: a shift along odom's axes, and a turn about its
// z axis.
Eigen::MatrixXd UnobservableDirections(const WindowState& state);

}  // namespace pangea::vio
