#include "thinning/node_removal.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

namespace pangea {
namespace {

KeyframeId Id(int32_t agent, int32_t seq) { return {{agent, 1}, seq}; }

class NodeRemovalTest : public ::testing::Test {
 protected:
  Eigen::Vector3d RandomVector(double scale) {
    std::normal_distribution<double> normal(0, scale);
    return {normal(random_), normal(random_), normal(random_)};
  }
  Rigid3 RandomPose() { return {ExpSo3(RandomVector(0.5)), RandomVector(2)}; }
  // Correlated; the sigmas are some millimetres and milliradians.
  Matrix6d RandomCovariance() {
    Matrix6d A;
    std::normal_distribution<double> normal(0, 0.003);
    for (double& a : A.reshaped()) {
      a = normal(random_);
    }
    return A * A.transpose() + 1e-6 * Matrix6d::Identity();
  }
  // The exact relative pose of the two.
  RelativePose Measure(const Rigid3& T_map_a, const Rigid3& T_map_b) {
    return {T_map_a.Inverse() * T_map_b, RandomCovariance()};
  }

  std::mt19937_64 random_{5};
};

Constraint MakeConstraint(const KeyframeId& from, const KeyframeId& to,
                          const RelativePose& relative) {
  Constraint constraint;
  constraint.from = from;
  constraint.to = to;
  constraint.T_from_to = relative.T_from_to;
  constraint.covariance = relative.covariance;
  return constraint;
}

// A linearised problem of relative poses: the reference for removals.
class DenseGraph {
 public:
  explicit DenseGraph(std::vector<Rigid3> T_map_body)
      : poses_(std::move(T_map_body)),
        information_(Eigen::MatrixXd::Zero(6 * std::ssize(poses_), 6 * std::ssize(poses_))) {}

  void Add(int a, int b, const Matrix6d& covariance) {
    const Eigen::MatrixXd J = Jacobian(a, b);
    information_ += J.transpose() * covariance.inverse() * J;
  }
  // Covariance of the pose of b in a, from all factors.
  Matrix6d MarginalOfRelative(int a, int b) const {
    // The gauge: pose a is fixed.
    Eigen::MatrixXd H = information_;
    H.block<6, 6>(6 * a, 6 * a) += 1e10 * Matrix6d::Identity();
    const Eigen::MatrixXd J = Jacobian(a, b);
    return J * H.ldlt().solve(J.transpose());
  }

 private:
  // d(T_a_b)/d(tangents of both poses), numerically.
  Eigen::MatrixXd Jacobian(int a, int b) const {
    constexpr double kStep = 1e-6;
    Eigen::MatrixXd J = Eigen::MatrixXd::Zero(6, information_.cols());
    const Rigid3 T_a_b = poses_[a].Inverse() * poses_[b];
    for (int k = 0; k < 6; ++k) {
      const Vector6d step = kStep * Vector6d::Unit(k);
      J.col(6 * a + k) = (poses_[a].Plus(step).Inverse() * poses_[b]).Minus(T_a_b) / kStep;
      J.col(6 * b + k) = (poses_[a].Inverse() * poses_[b].Plus(step)).Minus(T_a_b) / kStep;
    }
    return J;
  }

  std::vector<Rigid3> poses_;
  Eigen::MatrixXd information_;
};

void ExpectIs(const RelativePose& relative, const Rigid3& T, const Matrix6d& covariance) {
  EXPECT_LT(relative.T_from_to.Minus(T).norm(), 1e-9);
  EXPECT_LT((relative.covariance - covariance).norm(), 1e-3 * covariance.norm());
}

TEST_F(NodeRemovalTest, OfAChainLeavesTheDenseMarginal) {
  std::vector<Rigid3> poses;
  for (int i = 0; i < 6; ++i) {
    poses.push_back(RandomPose());
  }
  NodeRemoval removal;
  DenseGraph dense(poses);
  for (int i = 1; i < 6; ++i) {
    const RelativePose edge = Measure(poses[i - 1], poses[i]);
    removal.AddOdometry(Id(1, i - 1), Id(1, i), edge);
    dense.Add(i - 1, i, edge.covariance);
  }
  removal.RemoveRun({Id(1, 1), Id(1, 2), Id(1, 3), Id(1, 4)});
  ASSERT_EQ(removal.factors().size(), 2);
  const NodeRemoval::Factor& left = removal.factors().at(Id(1, 0)).at(Id(1, 5));
  EXPECT_TRUE(left.odometry);
  ExpectIs(left.relative, poses[0].Inverse() * poses[5], dense.MarginalOfRelative(0, 5));
}

// A removed visit, connected to the map by three constraints: each pair with the hub is exact, and
// no covariance is too small.
TEST_F(NodeRemovalTest, OfAStarLeavesTheMarginalsToTheBestKnown) {
  std::vector<Rigid3> poses;
  for (int i = 0; i < 4; ++i) {
    poses.push_back(RandomPose());
  }
  NodeRemoval removal;
  DenseGraph dense(poses);
  for (int i = 1; i < 4; ++i) {
    Constraint constraint = MakeConstraint(Id(1, 10 * i), Id(2, 0), Measure(poses[i], poses[0]));
    constraint.covariance *= i == 2 ? 0.1 : 1;
    constraint.num_inliers = 20 * i;
    removal.AddConstraint(constraint);
    dense.Add(i, 0, constraint.covariance);
  }
  removal.RemoveMaps({Id(2, 0)});
  ASSERT_EQ(removal.factors().size(), 3);
  const NodeRemoval::Neighbours& of_hub = removal.factors().at(Id(1, 20));
  ASSERT_EQ(of_hub.size(), 2);
  EXPECT_EQ(removal.factors().at(Id(1, 10)).size(), 1);
  ExpectIs(of_hub.at(Id(1, 10)).relative, poses[2].Inverse() * poses[1],
           dense.MarginalOfRelative(2, 1));
  ExpectIs(of_hub.at(Id(1, 30)).relative, poses[2].Inverse() * poses[3],
           dense.MarginalOfRelative(2, 3));
  EXPECT_EQ(of_hub.at(Id(1, 10)).num_inliers, 20);
  EXPECT_EQ(of_hub.at(Id(1, 30)).num_inliers, 40);
  EXPECT_TRUE(of_hub.at(Id(1, 30)).derived);
}

// Two removed keyframes are both connected to one that stays: they give a single factor.
// An odometry may say that an edge of it knows nothing, with variances of up to 1e12.
TEST_F(NodeRemovalTest, TheAverageWithWhatKnowsNothingIsACovariance) {
  const Rigid3 a = RandomPose(), b = RandomPose();
  for (int i = 0; i < 20; ++i) {
    RelativePose nothing = Measure(a, b);
    nothing.covariance *= 1e15;
    const RelativePose known = Measure(a, b);
    for (const RelativePose& mean : {Average(nothing, known), Average(known, nothing)}) {
      EXPECT_EQ(mean.covariance.llt().info(), Eigen::Success) << i;
      EXPECT_TRUE(mean.covariance.isApprox(known.covariance, 1e-3)) << i;
      EXPECT_LT(mean.T_from_to.Minus(known.T_from_to).norm(), 1e-6) << i;
    }
  }
}

TEST_F(NodeRemovalTest, AveragesWhatIsBetweenTheSameTwo) {
  std::vector<Rigid3> poses;
  for (int i = 0; i < 4; ++i) {
    poses.push_back(RandomPose());
  }
  NodeRemoval removal;
  DenseGraph dense(poses);
  // 0 stays in one map; 1 to 3 are in another map, of which 3 stays: a chain, so no information is
  // lost.
  for (int i = 2; i < 4; ++i) {
    const RelativePose edge = Measure(poses[i - 1], poses[i]);
    removal.AddOdometry(Id(2, i - 1), Id(2, i), edge);
    dense.Add(i - 1, i, edge.covariance);
  }
  for (const int seen : {1, 3}) {
    const RelativePose relative = Measure(poses[0], poses[seen]);
    removal.AddConstraint(MakeConstraint(Id(1, 0), Id(2, seen), relative));
    dense.Add(0, seen, relative.covariance);
  }
  removal.RemoveRun({Id(2, 1), Id(2, 2)});
  ASSERT_EQ(removal.factors().size(), 2);
  ExpectIs(removal.factors().at(Id(1, 0)).at(Id(2, 3)).relative, poses[0].Inverse() * poses[3],
           dense.MarginalOfRelative(0, 3));
}

TEST_F(NodeRemovalTest, OfARunGoesToTheNearerEndAndKeepsTheChain) {
  std::vector<Rigid3> poses;
  NodeRemoval removal;
  for (int i = 0; i < 8; ++i) {
    poses.push_back(RandomPose());
    if (i > 0) {
      removal.AddOdometry(Id(1, i - 1), Id(1, i), Measure(poses[i - 1], poses[i]));
    }
  }
  for (const int seen : {1, 6}) {
    const Matrix6d better_than_odometry = 1e-12 * Matrix6d::Identity();
    removal.AddConstraint(
        MakeConstraint(Id(2, 0), Id(1, seen), {poses[seen], better_than_odometry}));
  }
  removal.RemoveRun({Id(1, 1), Id(1, 2), Id(1, 3), Id(1, 4), Id(1, 5), Id(1, 6)});
  EXPECT_TRUE(removal.factors().at(Id(1, 0)).at(Id(1, 7)).odometry);
  EXPECT_EQ(removal.factors().at(Id(2, 0)).size(), 2);
  EXPECT_LT(removal.factors().at(Id(2, 0)).at(Id(1, 7)).relative.T_from_to.Minus(poses[7]).norm(),
            1e-9);
}

}  // namespace
}  // namespace pangea
