#pragma once

// Position steps in a recorded trajectory. EuRoC's Machine Hall ground truth jumps by up to 0.14 m
// from one sample to the next (the laser tracker lost and found its prism); differentiated twice
// such a jump is a blow of thousands of m/s^2. A step is a sample-to-sample move that differs from
// the median move around it; it is taken out and its offset blended in over seconds instead.

#include <vector>

#include "recording/trajectory.h"

namespace pangea::sim {

struct StepOptions {
  // Shortest deviation from the median move that counts as a step, metres.
  double min_step_m = 0.006;
  // The median is over this many moves to either side.
  int half_window = 20;
  // A step's offset is blended in over this long, seconds.
  double spread_s = 4.0;
};

struct PositionStep {
  int64_t utime = 0;  // of the sample behind the step
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();
};

std::vector<PositionStep> FindSteps(const Trajectory& trajectory, const StepOptions& options);
Trajectory SpreadSteps(const Trajectory& trajectory, const StepOptions& options);

}  // namespace pangea::sim
