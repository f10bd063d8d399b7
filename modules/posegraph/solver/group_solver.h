#pragma once

// The robust least-squares problem of one group: odometry edges are trusted, loops may be outliers.
//
//   min  sum_odometry |r|^2 + sum_loops min(|r|^2, c^2) + sum_scales (kappa / sigma)^2
//
// by graduated non-convexity for truncated least squares (Yang et al., RA-L 2020), with weights
// from covariances alone: c^2 is the 0.999 quantile of chi-squared with four degrees of freedom
// (kMaxLoopChi2). Levenberg-Marquardt with sparse Cholesky (block_equations.h), one thread: the
// same calls give the same bytes.

#include <limits>
#include <memory>
#include <vector>

#include "block_equations/block_equations.h"
#include "posegraph/solver/four_dof.h"
#include "posegraph/solver/pose_cost.h"

namespace pangea {

class GroupSolver {
 public:
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

  const Pose4& pose(int node) const { return state_.poses[node]; }
  bool loop_on(int loop) const { return edges_[loops_[loop]].weight > 0.5; }
  double log_scale(int scale) const { return state_.log_scales[scale]; }

  // Covariances of (p, yaw) of some nodes: 4x4 diagonal blocks of the inverse of J^T J, from the
  // last factor of the solve. Zero for a fixed node; sigmas of about 100 m and pi if no loop in
  // force connects it to one. Call after a solve.
  std::vector<Matrix4d> Marginals(const std::vector<int>& nodes);

 private:
  struct State {
    std::vector<Pose4> poses;
    std::vector<double> log_scales;
  };
  struct Edge {
    int from = 0, to = 0, scale = kMetric;
    PoseCost cost;
    double weight = 1;
  };
  static constexpr int kFixed = -1;
  static constexpr double kNoFactor = std::numeric_limits<double>::infinity();

  int AddEdge(const Edge& edge);
  void Begin();
  void Minimise(int max_iterations);
  void Linearise() const;
  bool Factorise(double damping);
  void AddToEquations(size_t edge) const;
  State MovedBy(const Eigen::VectorXd& step) const;
  double CostOf(const State& state) const;
  double SquaredResidual(const Edge& edge, const State& state) const;
  void SwitchUntilStable(const std::vector<bool>& may_go);
  bool InverseBlocks(const std::vector<int>& nodes, std::vector<Matrix4d>* blocks) const;

  State state_;
  std::vector<bool> fixed_;           // by node
  std::vector<double> scale_sigmas_;  // by scale
  std::vector<Edge> edges_;
  std::vector<int> loops_;  // edges that are loops
  // Variables of the equations: free nodes, then scales. Cliques: edges, then single variables.
  std::vector<int> variable_;  // by node
  std::unique_ptr<BlockEquations> equations_;
  double factor_damping_ = kNoFactor;
};

}  // namespace pangea
