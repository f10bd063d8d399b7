#include "sim/path/path_steps.h"

#include <algorithm>

#include "core/median.h"

namespace pangea::sim {
namespace {

// Share of a step's offset that is blended in: 0 before, 1 after, with zero velocity and
// acceleration at both ends (quintic smoothstep).
double Blend(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * x * (x * (6 * x - 15) + 10);
}

// Velocity between samples i - 1 and i.
Eigen::Vector3d Velocity(const Trajectory& t, size_t i) {
  return (t[i].T.t - t[i - 1].T.t) / (1e-6 * static_cast<double>(t[i].utime - t[i - 1].utime));
}

Eigen::Vector3d MedianVelocity(const Trajectory& t, size_t i, int half_window) {
  const auto half = static_cast<size_t>(half_window);
  const size_t begin = i > half ? i - half : 1;
  const size_t end = std::min(t.size(), i + half + 1);
  Eigen::Vector3d median;
  std::vector<double> values(end - begin);
  for (int axis = 0; axis < 3; ++axis) {
    for (size_t j = begin; j < end; ++j) {
      values[j - begin] = Velocity(t, j)[axis];
    }
    median[axis] = Median(values);
  }
  return median;
}

}  // namespace

std::vector<PositionStep> FindSteps(const Trajectory& trajectory, const StepOptions& options) {
  std::vector<PositionStep> steps;
  for (size_t i = 1; i < trajectory.size(); ++i) {
    const double dt = 1e-6 * static_cast<double>(trajectory[i].utime - trajectory[i - 1].utime);
    // A motion across a gap, or at a low rate, gives no information on steps.
    constexpr double kLongestInterval = 0.02;
    if (dt > kLongestInterval) {
      continue;
    }
    const Eigen::Vector3d offset =
        dt * (Velocity(trajectory, i) - MedianVelocity(trajectory, i, options.half_window));
    if (offset.norm() > options.min_step_m) {
      steps.push_back({trajectory[i].utime, offset});
    }
  }
  return steps;
}

Trajectory SpreadSteps(const Trajectory& trajectory, const StepOptions& options) {
  Trajectory spread = trajectory;
  for (const PositionStep& step : FindSteps(trajectory, options)) {
    for (StampedPose& pose : spread) {
      const double since = 1e-6 * static_cast<double>(pose.utime - step.utime);
      const double stepped = pose.utime >= step.utime ? 1.0 : 0.0;
      pose.T.t += (Blend(since / options.spread_s + 0.5) - stepped) * step.offset;
    }
  }
  return spread;
}

}  // namespace pangea::sim
