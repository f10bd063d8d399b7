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

// With its only loop switched off, nothing says where the second chain is.
TEST(GroupSolver, MarginalsOfAChainWithoutALoopInForce) {
  Relative4 same_place;
  same_place.covariance = 1e-2 * Matrix4d::Identity();
  Relative4 far = same_place;
  far.t.x() = 50;
  GroupSolver solver;
  const int fixed = solver.AddNode({}, true);
  const int held = solver.AddNode({}, false);
  solver.AddOdometry(fixed, held, same_place);
  const int first = solver.AddNode({}, false);
  const int second = solver.AddNode({}, false);
  solver.AddOdometry(first, second, same_place);
  solver.AddLoop(fixed, first, far, false);
  solver.SolveWarm({true});
  ASSERT_FALSE(solver.loop_on(0));
  const std::vector<Matrix4d> marginals = solver.Marginals({held, second});
  EXPECT_LT((marginals[0] - same_place.covariance).norm(), 1e-4);
  for (int i = 0; i < 4; ++i) {
    EXPECT_GT(marginals[1](i, i), 1) << i;
    EXPECT_LT(marginals[1](i, i), 1e5) << i;
  }
}

}  // namespace
}  // namespace pangea
