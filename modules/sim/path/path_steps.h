#pragma once

// Removes position steps in a recorded trajectory. EuRoC's Machine Hall ground truth jumps by up to
// 0.14 m between samples (the laser tracker lost its prism and found it again); differentiated
// twice, such a jump is an acceleration of thousands of m/s^2. A step is a motion between two
// samples that differs from the median motion around it. It is removed, and its offset is blended
// in over seconds instead.

#include <vector>

#include "recording/trajectory.h"

namespace pangea::sim {

struct StepOptions {
  // Smallest deviation from the median motion that counts as a step, metres.
  double min_step_m = 0.006;
  // The median is over this many motions on each side.
  int half_window = 20;
  // Time over which a step's offset is blended in, seconds.
  double spread_s = 4.0;
};

struct PositionStep {
  int64_t utime = 0;  // of the sample after the step
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();
};

std::vector<PositionStep> FindSteps(const Trajectory& trajectory, const StepOptions& options);
Trajectory SpreadSteps(const Trajectory& trajectory, const StepOptions& options);

}  // namespace pangea::sim
