#pragma once

// The window as others may look at it: where the body was at each of its frames, and how well that
// is known. Looking changes nothing.

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "core/rigid3.h"

namespace pangea::vio {

struct WindowPoses {
  std::vector<int64_t> utimes;  // ascending; the first may be a keyframe that was published
  std::vector<Rigid3> T_odom_body;
  // Of all of them, 6 a pose, in the window's coordinates (window_state.h): (dtheta, xi_p).
  Eigen::MatrixXd covariance;
};

}  // namespace pangea::vio
