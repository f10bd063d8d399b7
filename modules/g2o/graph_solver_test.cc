// Tests least squares of 6-DoF graphs: Jacobians, gauge, bad starts, and the minimum.

#include "g2o/graph_solver.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <random>

namespace pangea {
namespace {

Rigid3 RandomPose(std::mt19937* random, double sigma_m, double sigma_rad) {
  std::normal_distribution<double> normal;
  Vector6d xi;
  for (int i = 0; i < 6; ++i) {
    xi[i] = normal(*random) * (i < 3 ? sigma_m : sigma_rad);
  }
  return Rigid3().Plus(xi);
}

// Poses on a sphere, winding upwards, each connected with its predecessor and with the one below.
class Sphere {
 public:
  static constexpr int kRings = 6, kPerRing = 8, kCount = kRings * kPerRing;

  explicit Sphere(double sigma_m, double sigma_rad) : random_(7) {
    for (int i = 0; i < kCount; ++i) {
      const double longitude = 2 * M_PI * i / kPerRing, latitude = 2.4 * i / kCount - 1.2;
      const Eigen::Quaterniond q = YawRotation(longitude) * ExpSo3({0, -latitude, 0});
      truth_[i] = {q, q * Eigen::Vector3d(5, 0, 0)};
    }
    covariance_ = Vector6d(4, 1, 2, 1, 3, 2).asDiagonal();
    covariance_.topLeftCorner<3, 3>() *= sigma_m * sigma_m;
    covariance_.bottomRightCorner<3, 3>() *= sigma_rad * sigma_rad;
    for (int i = 1; i < kCount; ++i) {
      Measure(i - 1, i, sigma_m, sigma_rad);
      if (i >= kPerRing) {
        Measure(i - kPerRing, i, sigma_m, sigma_rad);
      }
    }
    graph_.vertices = truth_;
  }

  Graph& graph() { return graph_; }
  const std::map<int64_t, Rigid3>& truth() const { return truth_; }
  // The vertices by the measurements between successive ones alone, as in most published graphs.
  void StartByOdometry() {
    for (const GraphEdge& edge : graph_.edges) {
      if (edge.to == edge.from + 1) {
        graph_.vertices[edge.to] = graph_.vertices[edge.from] * edge.T_from_to;
      }
    }
  }

 private:
  void Measure(int from, int to, double sigma_m, double sigma_rad) {
    GraphEdge edge;
    edge.from = from;
    edge.to = to;
    edge.T_from_to = truth_[from].Inverse() * truth_[to] * RandomPose(&random_, sigma_m, sigma_rad);
    edge.covariance = covariance_;
    graph_.edges.push_back(edge);
  }

  std::mt19937 random_;
  std::map<int64_t, Rigid3> truth_;
  Matrix6d covariance_ = Matrix6d::Zero();
  Graph graph_;
};

TEST(Graph, JacobiansAreThoseOfTheError) {
  std::mt19937 random(3);
  GraphEdge edge;
  edge.T_from_to = RandomPose(&random, 2, 1);
  const Rigid3 from = RandomPose(&random, 2, 1), to = RandomPose(&random, 2, 1);
  const EdgeJacobians J = JacobiansOf(edge, from, to);
  constexpr double kStep = 1e-6;
  for (int k = 0; k < 6; ++k) {
    const Vector6d step = kStep * Vector6d::Unit(k);
    const Vector6d by_from =
        (EdgeError(edge, from.Plus(step), to) - EdgeError(edge, from.Plus(-step), to)) /
        (2 * kStep);
    const Vector6d by_to =
        (EdgeError(edge, from, to.Plus(step)) - EdgeError(edge, from, to.Plus(-step))) /
        (2 * kStep);
    EXPECT_LT((by_from - J.from.col(k)).norm(), 1e-8) << k;
    EXPECT_LT((by_to - J.to.col(k)).norm(), 1e-8) << k;
  }
}

TEST(Graph, TheErrorIsTheTangentToFirstOrder) {
  std::mt19937 random(4);
  GraphEdge edge;
  edge.T_from_to = RandomPose(&random, 2, 1);
  const Rigid3 from = RandomPose(&random, 2, 1);
  const Vector6d xi = 1e-4 * Vector6d(1, -2, 3, -1, 2, 0.5);
  const Rigid3 to = from * edge.T_from_to.Plus(xi);
  EXPECT_LT((EdgeError(edge, from, to) - xi).norm(), 1e-10);
}

TEST(GraphSolver, ExactMeasurementsGiveTheTruthFromAnyStart) {
  Sphere sphere(0.01, 0.01);
  for (GraphEdge& edge : sphere.graph().edges) {
    edge.T_from_to = sphere.truth().at(edge.from).Inverse() * sphere.truth().at(edge.to);
  }
  std::mt19937 random(5);
  for (auto& [number, pose] : sphere.graph().vertices) {
    pose = number == 0 ? pose : RandomPose(&random, 10, 3);
  }
  const GraphSolution solution = SolveGraph(&sphere.graph());
  EXPECT_TRUE(solution.averaged);
  EXPECT_TRUE(solution.converged);
  EXPECT_LT(solution.cost, 1e-12);
  for (const auto& [number, pose] : sphere.graph().vertices) {
    EXPECT_LT(pose.Minus(sphere.truth().at(number)).norm(), 1e-6) << number;
  }
}

// At the minimum the cost is chi-squared distributed, and no small step lowers it.
TEST(GraphSolver, ReachesTheMinimum) {
  Sphere sphere(0.05, 0.03);
  sphere.StartByOdometry();
  Graph& graph = sphere.graph();
  const GraphSolution solution = SolveGraph(&graph);
  EXPECT_TRUE(solution.converged);
  EXPECT_NEAR(solution.cost, Cost(graph), 1e-9);
  EXPECT_LT(solution.cost, solution.cost_at_start / 3);
  const double freedom = 6.0 * (std::ssize(graph.edges) - Sphere::kCount + 1);
  // The measurements' noise has a third to all of the variance that their covariance states.
  EXPECT_GT(solution.cost, 0.25 * freedom);
  EXPECT_LT(solution.cost, freedom);
  std::mt19937 random(6);
  for (auto& [number, pose] : graph.vertices) {
    const Rigid3 before = pose;
    for (int k = 0; number != 0 && k < 12; ++k) {
      pose = before.Plus((k % 2 == 0 ? 1e-3 : -1e-3) * Vector6d::Unit(k / 2));
      EXPECT_GT(Cost(graph), solution.cost) << number << " " << k;
    }
    pose = before;
  }
}

TEST(GraphSolver, FixedVerticesAndOneOfEachPartStay) {
  Sphere sphere(0.05, 0.03);
  Graph& graph = sphere.graph();
  std::erase_if(graph.edges, [](const GraphEdge& edge) {  // two parts: up to 19, and from 20 on
    return edge.from < 20 && edge.to >= 20;
  });
  graph.fixed = {7, 9};
  sphere.StartByOdometry();
  const std::map<int64_t, Rigid3> before = graph.vertices;
  EXPECT_TRUE(SolveGraph(&graph).converged);
  for (const auto& [number, pose] : graph.vertices) {
    const bool held = number == 7 || number == 9 || number == 20;
    EXPECT_EQ(pose.Minus(before.at(number)).norm() == 0, held) << number;
  }
}

TEST(GraphSolver, NothingToSolve) {
  Graph graph;
  graph.vertices[5] = Rigid3();
  const GraphSolution solution = SolveGraph(&graph);
  EXPECT_TRUE(solution.converged);
  EXPECT_EQ(solution.cost, 0);
}

}  // namespace
}  // namespace pangea
