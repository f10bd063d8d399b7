#pragma once

// Levenberg-Marquardt on dense normal equations, with Marquardt's damping: a share of the diagonal
// (Marquardt 1963). What is eliminated beforehand (landmarks) is damped by who eliminates it.

#include <Eigen/Core>
#include <cmath>
#include <utility>

namespace pangea {

// The solution x of H x = b, H symmetric and positive semidefinite, scaled to a unit diagonal
// first: the units differ by orders of magnitude. Columns of b are solved together.
Eigen::MatrixXd SolveScaled(const Eigen::MatrixXd& H, const Eigen::MatrixXd& b);

struct LevenbergMarquardtOptions {
  int max_iterations = 0;
  int max_retries = 0;      // each with ten times the damping
  double min_decrease = 0;  // an undamped step that should lower the cost by less is the last
  double tolerance = 0;     // rise of the cost, as a share of it, that rounding may make
};

struct LevenbergMarquardtResult {
  double cost = 0;
  bool converged = false;  // false: no step made it better, though one should
};

// Minimises the cost of `problem` in place.
//   linearise(problem, damping): equations with members cost, H, g
//   solve(problem, equations): x of H x = g
//   retract(equations, step, &problem)
//   cost(problem)
// What a step moves: problem.Estimate(), problem.SetEstimate().
template <typename Problem, typename Linearise, typename Solve, typename Retract, typename Cost>
LevenbergMarquardtResult LevenbergMarquardt(const LevenbergMarquardtOptions& options,
                                            const Linearise& linearise, const Solve& solve,
                                            const Retract& retract, const Cost& cost_of,
                                            Problem* problem) {
  LevenbergMarquardtResult result;
  double damping = 0;
  for (int iteration = 0; iteration < options.max_iterations; ++iteration) {
    bool better = false;
    bool is_last = false;
    for (int attempt = 0; attempt < options.max_retries && !better; ++attempt) {
      auto equations = linearise(*problem, damping);
      result.cost = equations.cost;
      equations.H.diagonal() *= 1 + damping;
      const Eigen::VectorXd step = -solve(*problem, equations);
      // A damped step lowers the cost little because it is short.
      is_last = damping == 0 && -0.5 * equations.g.dot(step) < options.min_decrease;
      auto before = problem->Estimate();
      if (step.allFinite()) {
        retract(equations, step, problem);
        const double cost = cost_of(*problem);
        better = cost <= result.cost + options.tolerance * (1 + std::abs(result.cost));
        result.cost = better ? cost : result.cost;
      }
      if (better) {
        damping = damping < 1e-5 ? 0 : 0.1 * damping;
      } else {
        problem->SetEstimate(std::move(before));
        damping = damping == 0 ? 1e-4 : 10 * damping;
      }
    }
    if (!better) {
      return result;
    }
    if (is_last) {
      break;
    }
  }
  result.converged = true;
  return result;
}

}  // namespace pangea
