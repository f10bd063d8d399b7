#pragma once

// What a keyframe takes with it when it is published: its odometry edge with the covariance of the
// window's own marginals, and the depths of what it saw.

#include <Eigen/Core>
#include <vector>

#include "vio/keyframes/track_history.h"
#include "vio/window/estimator.h"
#include "vio/window/window_state.h"

namespace pangea::vio {

// Covariance of T_i_j = T_odom_i^-1 T_odom_j, (translation, rotation) in i's body frame, from the
// window's covariance P.
Matrix6d RelativeCovariance(const WindowState& state, const Eigen::MatrixXd& P, int i, int j);

// An edge starts at pose i as it was published; by the time of j the window has corrected it. A
// correction is independent of the error that is left, so its covariance is what i's, in the
// window's coordinates, has lost since: `lost`. This is what that adds to the edge.
Matrix6d CorrectionCovariance(const Matrix6d& lost, const Rigid3& T_odom_i, const Rigid3& T_odom_j);

// Pose, velocity, biases, tilt covariance and depths of frame `index`. No edge and no
// preintegration yet.
FinishedKeyframe FinishKeyframe(const WindowState& state, const Eigen::MatrixXd& P,
                                const TrackHistory& history, int index);

}  // namespace pangea::vio
