#pragma once

// What a keyframe takes with it when it leaves the window: its odometry edge with the covariance of
// the window's own marginals, and the depths of what it saw.

#include <optional>
#include <vector>

#include "vio/estimator.h"
#include "vio/track_history.h"
#include "vio/window_state.h"

namespace pangea::vio {

// Covariance of T_i_j = T_odom_i^-1 T_odom_j, (translation, rotation) in i's body frame.
Matrix6d RelativeCovariance(const WindowState& state, int i, int j);

// Pose, velocity, biases, tilt covariance and depths of clone `index`. No edge and no
// preintegration yet.
FinishedKeyframe FinishKeyframe(const WindowState& state, const TrackHistory& history, int index);

}  // namespace pangea::vio
