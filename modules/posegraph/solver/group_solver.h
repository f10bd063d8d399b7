#pragma once

// The robust least-squares problem of one group: odometry edges that hold, loops that may be wrong.
//
//   min  sum_odometry |r|^2 + sum_loops min(|r|^2, c^2) + sum_scales (kappa / sigma)^2
//
// by graduated non-convexity for truncated least squares (Yang et al., RA-L 2020), weights alone
// from covariances: c^2 is a quantile of chi-squared with four degrees of freedom. Sparse Cholesky
// (SuiteSparse through Ceres), one thread: the same calls give the same bytes.

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
  // A map whose metres are exp(kappa) true ones, kappa = 0 +- sigma; the solve begins at log_scale.
  int AddScale(double log_scale, double sigma);
  // `scale`: whose metres the measurement is in.
  void AddOdometry(int from, int to, const Relative4& relative, int scale = kMetric);
  // `on`: whether the solve begins with it.
  int AddLoop(int from, int to, const Relative4& relative, bool on, int scale = kMetric);

  // From the beginning: every loop's weight is found anew.
  void SolveGraduated();
  // From a solution: loops in `may_go` are switched off when they contradict it, and those that are
  // off come back when they fit.
  void SolveWarm(const std::vector<bool>& may_go);

  Pose4 pose(int node) const;
  bool loop_on(int loop) const { return loops_[loop].weight > 0.5; }
  double log_scale(int scale) const { return scales_[scale]; }

  // Covariances of (p, yaw) of some nodes: 4x4 blocks of the inverse of J^T J, by one sparse
  // factorisation, and of a solve what each needs. Zero for a fixed node.
  std::vector<Matrix4d> Marginals(const std::vector<int>& nodes) const;

 private:
  struct Loop {
    int from = 0, to = 0, scale = kMetric;
    Relative4 relative;
    Matrix4d whitening;
    double weight = 1;
    double sqrt_weight = 1;  // what the cost function reads
  };

  void AddEdge(int from, int to, int scale, const Relative4& relative, const Matrix4d& whitening,
               const double* sqrt_weight);
  void Minimise(int max_iterations);
  double SquaredResidual(const Loop& loop) const;
  static void SetWeight(Loop* loop, double weight);
  // Until no loop changes sides; returns whether any did.
  void SwitchUntilStable(const std::vector<bool>& may_go);

  std::deque<std::array<double, 4>> nodes_;
  std::vector<bool> fixed_;
  std::deque<double> scales_;
  std::deque<Loop> loops_;
  std::unique_ptr<ceres::Problem> problem_;
};

}  // namespace pangea
