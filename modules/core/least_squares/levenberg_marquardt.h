#pragma once

// Levenberg-Marquardt on dense normal equations. The damping is a share of the diagonal
// (Marquardt 1963). Whoever eliminates variables beforehand (landmarks) has to damp them.

#include <Eigen/Core>
#include <cmath>
#include <utility>

namespace pangea {

// Solves H x = b for a symmetric, positive semidefinite H and any number of columns b. H is first
// scaled to a unit diagonal, because the units of its rows differ by orders of magnitude.
Eigen::MatrixXd SolveScaled(const Eigen::MatrixXd& H, const Eigen::MatrixXd& b);

struct LevenbergMarquardtOptions {
  int max_iterations = 0;
  int max_retries = 0;      // per iteration; each one has ten times the damping
  double min_decrease = 0;  // stops after an undamped step with a smaller predicted decrease
  double tolerance = 0;     // share by which rounding may raise the cost of an accepted step
};

struct LevenbergMarquardtResult {
  double cost = 0;
  bool converged = false;  // false: in some iteration no step lowered the cost
};

// Minimises the cost of `problem` in place. The caller provides:
//   linearise(problem, damping): returns equations with members cost, H, g
//   solve(problem, equations): returns x with H x = g
//   retract(equations, step, &problem): applies the step
//   cost(problem): returns the cost
// problem.Estimate() and problem.SetEstimate() save and restore the variables that a step changes.
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
