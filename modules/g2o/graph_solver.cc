#include "g2o/graph_solver.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "block_equations/block_equations.h"
#include "g2o/graph_indices.h"
#include "g2o/rotation_averaging.h"

namespace pangea {
namespace {

// Of the diagonal. The first step is nearly that of Gauss and Newton, and no later one is closer.
constexpr double kFirstDamping = 1e-12, kMaxDamping = 1e6;
// Change at which the descent ends: a share of the cost, or of one.
constexpr double kTolerance = 1e-7;

class Descent {
 public:
  Descent(const Graph& graph, const GraphIndices& indices)
      : graph_(graph),
        indices_(indices),
        equations_(std::vector<int>(indices.num_variables(), 6), indices.cliques()) {
    for (const GraphEdge& edge : graph.edges) {
      information_.push_back(edge.covariance.ldlt().solve(Matrix6d::Identity()));
    }
  }

  double CostAt(const std::vector<Rigid3>& poses) const {
    double cost = 0;
    for (size_t i = 0; i < information_.size(); ++i) {
      const auto& [from, to] = indices_.ends()[i];
      const Vector6d error = EdgeError(graph_.edges[i], poses[from], poses[to]);
      cost += error.dot(information_[i] * error);
    }
    return std::isfinite(cost) ? cost : std::numeric_limits<double>::infinity();
  }

  // Moves the poses; returns whether it converged. The damping follows Nielsen (IMM-REP-1999-05).
  bool Minimise(std::vector<Rigid3>* poses, GraphSolution* solution) {
    double damping = kFirstDamping, growth = 2;
    double cost = CostAt(*poses);
    while (solution->iterations < kMaxGraphIterations && damping < kMaxDamping) {
      ++solution->iterations;
      Linearise(*poses);
      equations_.Damp(damping);
      const std::optional<Eigen::VectorXd> step = equations_.Solve();
      std::vector<Rigid3> moved = step ? Moved(*poses, *step) : *poses;
      const double change = step ? cost - CostAt(moved) : -std::numeric_limits<double>::infinity();
      const double negligible = kTolerance * std::max(1.0, cost);
      if (change < -negligible) {
        damping *= growth;
        growth *= 2;
        continue;
      }
      const double gain = change / std::max(negligible, -equations_.g().dot(*step));
      damping = std::max(kFirstDamping, damping * std::max(1.0 / 3, 1 - std::pow(2 * gain - 1, 3)));
      growth = 2;
      *poses = std::move(moved);
      cost -= change;
      if (change <= negligible) {
        return true;
      }
    }
    return false;
  }

 private:
  void Linearise(const std::vector<Rigid3>& poses) {
    equations_.SetZero();
    for (size_t i = 0; i < information_.size(); ++i) {
      AddEdge(i, poses);
    }
  }

  void AddEdge(size_t i, const std::vector<Rigid3>& poses) {
    const auto& [from, to] = indices_.ends()[i];
    const EdgeJacobians J = JacobiansOf(graph_.edges[i], poses[from], poses[to]);
    const Vector6d weighted = information_[i] * EdgeError(graph_.edges[i], poses[from], poses[to]);
    // In the order of the clique.
    const Matrix6d* jacobians[2];
    size_t members = 0;
    for (const int variable : indices_.cliques()[i]) {
      jacobians[members++] = variable == indices_.VariableOf(from) ? &J.from : &J.to;
      equations_.g().segment<6>(equations_.ColumnOf(variable)) +=
          jacobians[members - 1]->transpose() * weighted;
    }
    for (size_t a = 0; a < members; ++a) {
      const Matrix6d weighted_a = information_[i] * *jacobians[a];
      for (size_t b = 0; b <= a; ++b) {
        equations_.Add(i, a, b, Matrix6d(weighted_a.transpose() * *jacobians[b]));
      }
    }
  }

  std::vector<Rigid3> Moved(const std::vector<Rigid3>& poses, const Eigen::VectorXd& step) const {
    std::vector<Rigid3> moved = poses;
    for (size_t vertex = 0; vertex < poses.size(); ++vertex) {
      if (const int variable = indices_.VariableOf(static_cast<int>(vertex));
          variable != GraphIndices::kStays) {
        moved[vertex] = poses[vertex].Plus(step.segment<6>(equations_.ColumnOf(variable)));
      }
    }
    return moved;
  }

  const Graph& graph_;
  const GraphIndices& indices_;
  BlockEquations equations_;
  std::vector<Matrix6d> information_;
};

}  // namespace

GraphSolution SolveGraph(Graph* graph) {
  GraphSolution solution;
  solution.cost_at_start = Cost(*graph);
  const GraphIndices indices(*graph);
  std::vector<Rigid3> poses;
  for (const auto& [number, pose] : graph->vertices) {
    poses.push_back(pose);
  }
  Descent descent(*graph, indices);
  std::vector<Rigid3> averaged = AveragePoses(*graph, indices, poses);
  if (!averaged.empty() && descent.CostAt(averaged) < solution.cost_at_start) {
    poses = std::move(averaged);
    solution.averaged = true;
  }
  solution.converged = descent.Minimise(&poses, &solution);
  size_t vertex = 0;
  for (auto& [number, pose] : graph->vertices) {
    pose = poses[vertex++];
  }
  solution.cost = Cost(*graph);
  return solution;
}

}  // namespace pangea
