#include "vio/window/window_solver.h"

#include <gtest/gtest.h>

#include "core/least_squares/levenberg_marquardt.h"
#include "vio/window/testing/window_test_world.h"
#include "vio/window/window_problem.h"

namespace pangea::vio {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

WindowProblem NoisyWindow(uint64_t seed, double stamp_sigma_s) {
  WindowTestOptions options;
  options.seed = seed;
  options.frames = 7;
  options.landmarks = 40;
  options.ray_noise = 1;
  options.stamp_sigma_s = stamp_sigma_s;
  WindowProblem problem = TestWindow(options);
  HoldStart(&problem, 0.01);
  return problem;
}

void ExpectTheDenseSolution(const WindowProblem& problem) {
  const NormalEquations equations = Linearise(problem, 0);
  MatrixXd b(equations.H.rows(), 3);
  b << equations.g, RandomError(problem.state, 1, 1), RandomError(problem.state, 1, 2);
  const MatrixXd x = SolveWindow(problem.state, equations.H, b);
  const MatrixXd dense = SolveScaled(equations.H, b);
  const VectorXd scale = equations.H.diagonal().cwiseSqrt();
  const MatrixXd difference = scale.asDiagonal() * (x - dense);
  EXPECT_LT(difference.norm(), 1e-8 * (scale.asDiagonal() * dense).norm());
  // If both were equal to the last bit, a wrong factor would have passed the work to the dense
  // solver.
  EXPECT_NE(x, dense);
}

// A new window, then windows after marginalisations: these have a prior on velocity and biases of
// the oldest frame and on all that it saw, with and without a kept pose before it.
TEST(SolveWindow, IsTheDenseSolution) {
  for (const double stamp_sigma_s : {0.0, 0.004}) {
    for (const bool keep_pose : {false, true}) {
      WindowProblem problem = NoisyWindow(3, stamp_sigma_s);
      ExpectTheDenseSolution(problem);
      for (int round = 0; round < 3; ++round) {
        MarginaliseOldest(problem, {.keep_pose = keep_pose, .drop_kept_pose = true});
        ExpectTheDenseSolution(problem);
      }
    }
  }
}

// A matrix that is indefinite by rounding has no Cholesky factor: then the dense solver's result is
// returned.
TEST(SolveWindow, TakesWhatIsNotPositive) {
  const WindowProblem problem = NoisyWindow(4, 0);
  NormalEquations equations = Linearise(problem, 0);
  equations.H(kTimeOffset, kTimeOffset) = 0;
  EXPECT_EQ(SolveWindow(problem.state, equations.H, equations.g),
            SolveScaled(equations.H, equations.g));
}

}  // namespace
}  // namespace pangea::vio
