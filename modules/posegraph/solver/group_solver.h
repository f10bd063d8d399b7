#pragma once

// The robust least-squares problem of one group: odometry edges are trusted, loops may be outliers.
//
//   min  sum_odometry |r|^2 + sum_loops min(|r|^2, c^2) + sum_scales (kappa / sigma)^2
//
// by graduated non-convexity for truncated least squares (Yang et al., RA-L 2020), with weights
// from covariances alone: c^2 is the 0.999 quantile of chi-squared with four degrees of freedom
// (kMaxLoopChi2). Sparse Cholesky (SuiteSparse through Ceres), one thread: the same calls give the
// same bytes.

#include <array>
#include <deque>
#include <memory>
#include <vector>

#include "posegraph/solver/four_dof.h"

namespace ceres {
class Problem;
}

namespace pangea {

class GroupSolver {
 public:
  GroupSolver();
  ~GroupSolver();
  GroupSolver(const GroupSolver&) = delete;
  GroupSolver& operator=(const GroupSolver&) = delete;

  static constexpr int kMetric = -1;

  int AddNode(const Pose4& pose, bool fixed);
  // Adds the scale of a map: one metre of its odometry is exp(kappa) metres, with the prior kappa =
  // 0 +- sigma. The solve starts at kappa = log_scale.
  int AddScale(double log_scale, double sigma);
  // `scale`: the index from AddScale for the map in whose units the measurement is; else kMetric.
  void AddOdometry(int from, int to, const Relative4& relative, int scale = kMetric);
  // `on`: whether the loop is in force at the start of the solve.
  int AddLoop(int from, int to, const Relative4& relative, bool on, int scale = kMetric);

  // Finds the weight of every loop anew (graduated non-convexity).
  void SolveGraduated();
  // Starts from a solution: loops with `may_go` are switched off if they contradict it, and loops
  // that are off are switched on again if they fit.
  void SolveWarm(const std::vector<bool>& may_go);

  Pose4 pose(int node) const;
  bool loop_on(int loop) const { return loops_[loop].weight > 0.5; }
  double log_scale(int scale) const { return scales_[scale]; }

  // Covariances of (p, yaw) of some nodes: 4x4 diagonal blocks of the inverse of J^T J, from one
  // sparse factorisation; per node only the needed part of the triangular solve is done. Zero for a
  // fixed node; sigmas of about 100 m and pi if no loop in force connects it to one.
  std::vector<Matrix4d> Marginals(const std::vector<int>& nodes) const;

 private:
  struct Loop {
    int from = 0, to = 0, scale = kMetric;
    Relative4 relative;
    Matrix4d whitening;
    double weight = 1;
    double sqrt_weight = 1;  // the cost function reads it through a pointer
  };

  void AddEdge(int from, int to, int scale, const Relative4& relative, const Matrix4d& whitening,
               const double* sqrt_weight);
  void Minimise(int max_iterations);
  double SquaredResidual(const Loop& loop) const;
  static void SetWeight(Loop* loop, double weight);
  void SwitchUntilStable(const std::vector<bool>& may_go);

  std::deque<std::array<double, 4>> nodes_;
  std::vector<bool> fixed_;
  std::deque<double> scales_;
  std::deque<Loop> loops_;
  std::unique_ptr<ceres::Problem> problem_;
};

}  // namespace pangea
