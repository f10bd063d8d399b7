#include "posegraph/solver/group_solver.h"

#include <gtest/gtest.h>

namespace pangea {
namespace {

// A chain of nodes at one place, with a fixed first node, closed by a loop with the covariance of
// an edge. As with resistors, the two paths from the first node to any other are in parallel.
TEST(GroupSolver, MarginalsOfAClosedChain) {
  constexpr int kLast = 30;
  Matrix4d root = Matrix4d::Identity();
  root(0, 1) = 0.3;
  root(3, 0) = -0.2;
  Relative4 same_place;
  same_place.covariance = 1e-2 * root * root.transpose();
  GroupSolver solver;
  std::vector<int> nodes;
  for (int i = 0; i <= kLast; ++i) {
    nodes.push_back(solver.AddNode(Pose4{Eigen::Vector3d::Zero(), 0}, i == 0));
    if (i > 0) {
      solver.AddOdometry(i - 1, i, same_place);
    }
  }
  solver.AddLoop(0, kLast, same_place, true);
  solver.SolveGraduated();
  const std::vector<Matrix4d> marginals = solver.Marginals(nodes);
  ASSERT_EQ(marginals.size(), nodes.size());
  for (int i = 0; i <= kLast; ++i) {
    const double parallel = static_cast<double>(i * (kLast + 1 - i)) / (kLast + 1);
    EXPECT_LT((marginals[i] - parallel * same_place.covariance).norm(), 1e-9) << "node " << i;
  }
}

}  // namespace
}  // namespace pangea
