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

// An edge starts at pose i as it was published, but until j is published the window corrects pose
// i. The correction is independent of the remaining error, so its covariance is `lost`: the
// decrease of i's covariance since it was published, in the window's coordinates. Returns the
// covariance that this adds to the edge.
Matrix6d CorrectionCovariance(const Matrix6d& lost, const Rigid3& T_odom_i, const Rigid3& T_odom_j);

// Fills pose, velocity, biases, covariances and depths of frame `index`; edge and preintegration
// stay empty.
FinishedKeyframe FinishKeyframe(const WindowState& state, const Eigen::MatrixXd& P,
                                const TrackHistory& history, int index);

}  // namespace pangea::vio
