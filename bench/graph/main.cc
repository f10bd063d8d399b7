// Solves a pose graph in g2o format twice, by our solver and as Ceres' example of 3-D pose graphs
// does (examples/slam/pose_graph_3d: automatic differentiation, position and quaternion, default
// options, 200 iterations), and prints a row of a table. Both minimise the same cost.

#include <ceres/ceres.h>
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <Eigen/Cholesky>
#include <string>

#include "bench/process_use.h"
#include "blas/blas.h"
#include "g2o/g2o.h"
#include "g2o/graph_solver.h"

namespace pangea::bench {
namespace {

struct Result {
  double cost = 0, cpu_s = 0;
  int iterations = 0;
  bool converged = false;
};

// EdgeError (g2o/graph.h), whitened.
class EdgeCost {
 public:
  explicit EdgeCost(const GraphEdge& edge)
      : edge_(edge), whitening_(Matrix6d(edge.covariance.inverse()).llt().matrixL().transpose()) {}

  template <typename T>
  bool operator()(const T* p_from, const T* q_from, const T* p_to, const T* q_to,
                  T* residuals) const {
    using Vector3 = Eigen::Matrix<T, 3, 1>;
    using Quaternion = Eigen::Quaternion<T>;
    const Eigen::Map<const Vector3> from(p_from), to(p_to);
    const Eigen::Map<const Quaternion> rotation_from(q_from), rotation_to(q_to);
    const Quaternion to_from = rotation_from.conjugate();
    const Quaternion error =
        to_from * rotation_to * edge_.T_from_to.q.conjugate().template cast<T>();
    Eigen::Map<Eigen::Matrix<T, 6, 1>> residual(residuals);
    residual << to_from * (to - from) - edge_.T_from_to.t.template cast<T>(), T(2) * error.vec();
    residual.applyOnTheLeft(whitening_.template cast<T>());
    return true;
  }

 private:
  GraphEdge edge_;
  Matrix6d whitening_;
};

Result ByCeres(Graph graph) {
  ceres::Problem problem;
  for (const GraphEdge& edge : graph.edges) {
    Rigid3& from = graph.vertices.at(edge.from);
    Rigid3& to = graph.vertices.at(edge.to);
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<EdgeCost, 6, 3, 4, 3, 4>(new EdgeCost(edge)), nullptr,
        from.t.data(), from.q.coeffs().data(), to.t.data(), to.q.coeffs().data());
    for (Rigid3* pose : {&from, &to}) {
      problem.SetManifold(pose->q.coeffs().data(), new ceres::EigenQuaternionManifold);
    }
  }
  Rigid3& first = graph.vertices.begin()->second;
  problem.SetParameterBlockConstant(first.t.data());
  problem.SetParameterBlockConstant(first.q.coeffs().data());
  ceres::Solver::Options options;
  options.max_num_iterations = kMaxGraphIterations;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  const double begin_ms = CpuMs();
  ceres::Solve(options, &problem, &summary);
  const double cpu_s = 1e-3 * (CpuMs() - begin_ms);
  return {Cost(graph), cpu_s, summary.num_successful_steps + summary.num_unsuccessful_steps,
          summary.termination_type == ceres::CONVERGENCE};
}

Result ByUs(Graph graph) {
  const double begin_ms = CpuMs();
  const GraphSolution solution = SolveGraph(&graph);
  return {solution.cost, 1e-3 * (CpuMs() - begin_ms), solution.iterations, solution.converged};
}

std::string Shown(const Result& result) {
  return fmt::format("{:.6g} | {}{} | {:.2f}", result.cost, result.iterations,
                     result.converged ? "" : ", not converged", result.cpu_s);
}

}  // namespace
}  // namespace pangea::bench

int main(int argc, char** argv) {
  CLI::App app("A pose graph solved by us and by Ceres' example: cost, iterations, s of CPU each",
               "pangea-graph-bench");
  std::string path;
  app.add_option("graph", path, "g2o file")->required()->check(CLI::ExistingFile);
  CLI11_PARSE(app, argc, argv);
  fmt::print(stderr, "{}\n", pangea::ToString(pangea::LoadedBlas()));
  pangea::UseOneThread();  // for Ceres too
  try {
    const pangea::Graph graph = pangea::ReadG2o(path);
    const pangea::bench::Result ceres = pangea::bench::ByCeres(graph);
    const pangea::bench::Result ours = pangea::bench::ByUs(graph);
    fmt::print("{} | {} | {} | {} | {:.2f}\n", graph.vertices.size(), graph.edges.size(),
               Shown(ceres), Shown(ours), ours.cpu_s / ceres.cpu_s);
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "pangea-graph-bench: {}\n", error.what());
    return 1;
  }
}
