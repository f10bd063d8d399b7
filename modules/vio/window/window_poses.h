#pragma once

// A copy of the window's poses with their covariance, for users outside the estimator.

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "core/rigid3.h"

namespace pangea::vio {

struct WindowPoses {
  std::vector<int64_t> utimes;  // ascending; the first may be a keyframe that was published
  std::vector<Rigid3> T_odom_body;
  // Joint covariance, 6 rows per pose: (dtheta, xi_p) in the coordinates of window_state.h.
  Eigen::MatrixXd covariance;
};

struct WindowProblem;
WindowPoses PosesOf(const WindowProblem& problem);

}  // namespace pangea::vio
