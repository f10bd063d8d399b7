#pragma once

// Computes the parts of a published keyframe: state, covariances from the window's marginals, and
// the depths of its landmarks.

#include <Eigen/Core>
#include <vector>

#include "vio/keyframes/track_history.h"
#include "vio/window/estimator.h"
#include "vio/window/window_state.h"

namespace pangea::vio {

// Covariance of T_i_j = T_odom_i^-1 T_odom_j, order (translation, rotation), in i's body frame,
// from the window's covariance P.
Matrix6d RelativeCovariance(const WindowState& state, const Eigen::MatrixXd& P, int i, int j);

// Fills pose, velocity, biases, covariances and depths of frame `index`; edge and preintegration
// stay empty.
FinishedKeyframe FinishKeyframe(const WindowState& state, const Eigen::MatrixXd& P,
                                const TrackHistory& history, int index);

}  // namespace pangea::vio
