#include "vio/window/window_poses.h"

#include "vio/window/window_problem.h"

namespace pangea::vio {

WindowPoses PosesOf(const WindowProblem& problem) {
  const WindowState& state = problem.state;
  WindowPoses poses;
  std::vector<int> rows;
  for (int i = 0; i <= state.Newest(); ++i) {
    poses.utimes.push_back(state.frames[i].utime);
    poses.T_odom_body.push_back(state.PoseAhead(i, state.Ahead(i, 0)));
    for (int row = 0; row < kPoseSize; ++row) {
      rows.push_back(state.FirstRow(i) + row);
    }
  }
  poses.covariance = WindowCovariance(problem, rows)(rows, rows);
  return poses;
}

}  // namespace pangea::vio
