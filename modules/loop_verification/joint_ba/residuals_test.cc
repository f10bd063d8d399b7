#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "core/least_squares/edge_residual.h"
#include "core/testing/numeric_jacobian.h"
#include "core/testing/test_random.h"
#include "loop_verification/correspondences/point_observation.h"
#include "loop_verification/joint_ba/hosted_point.h"

namespace pangea {
namespace {

using Random = std::mt19937_64;

Eigen::Vector3d UniformVector(Random& random, double size) {
  return {Uniform(random, -size, size), Uniform(random, -size, size), Uniform(random, -size, size)};
}

Rigid3 UniformPose(Random& random, double angle, double distance) {
  return {ExpSo3(UniformVector(random, angle)), UniformVector(random, distance)};
}

Matrix6d RandomCovariance(Random& random) {
  Matrix6d A;
  for (int i = 0; i < 36; ++i) {
    A(i) = Uniform(random, -1, 1);
  }
  return 1e-2 * (A * A.transpose() + 0.1 * Matrix6d::Identity());
}

TEST(EdgeResidual, JacobianWithACorrelatedCovariance) {
  Random random(3);
  for (int run = 0; run < 100; ++run) {
    const Rigid3 T_from = UniformPose(random, 2, 5), T_from_to = UniformPose(random, 0.5, 1);
    const Rigid3 T_to = T_from * T_from_to * UniformPose(random, 0.1, 0.1);
    const double kappa = Uniform(random, -0.3, 0.3);
    for (const auto scale : {EdgeResidual::Scale::kMap, EdgeResidual::Scale::kOdometry}) {
      const EdgeResidual edge(T_from_to, RandomCovariance(random), scale);
      EdgeResidual::Jacobians J;
      const Vector6d r = edge.Evaluate(T_from, T_to, kappa, &J);
      Eigen::Matrix<double, 6, 13> analytic;
      analytic << J.from, J.to, J.scale;
      const Eigen::MatrixXd numeric = NumericJacobian(13, 1e-5, [&](const Eigen::VectorXd& e) {
        return edge.Evaluate(T_from.Plus(e.head<6>()), T_to.Plus(e.segment<6>(6)), kappa + e[12]);
      });
      EXPECT_LT((numeric - analytic).norm() / (1 + numeric.norm() + r.norm()), 1e-6);
    }
  }
}

// The whitened residual squared is the Mahalanobis distance of the convention's error.
TEST(EdgeResidual, IsWhitenedByItsCovariance) {
  Random random(4);
  const Rigid3 T_from = UniformPose(random, 2, 5), T_from_to = UniformPose(random, 0.5, 1);
  const Matrix6d covariance = RandomCovariance(random);
  Vector6d xi;
  xi << 0.1, -0.2, 0.05, 0.01, 0.03, -0.02;
  const Vector6d residual =
      EdgeResidual(T_from_to, covariance).Evaluate(T_from, T_from * T_from_to.Plus(xi), 0);
  EXPECT_NEAR(residual.squaredNorm(), xi.dot(covariance.inverse() * xi), 1e-6);
}

// A host and two cameras that see its point, and the errors of all: the host's, the observations',
// the log scale's and the point's own.
class HostedPointTest : public testing::Test {
 protected:
  static constexpr int kErrors = 18 + 1 + 3;

  HostedPointTest() {
    for (int frame = 0; frame < 3; ++frame) {
      T_w_body_.push_back(UniformPose(random_, 0.1, 0.3));
      T_body_cam_.push_back(UniformPose(random_, 0.3, 0.1));
    }
    Eigen::Matrix2d sqrt_info;
    sqrt_info << 40, 2, -1, 38;
    hosted_.ray = {0.1, -0.05};
    hosted_.sqrt_info = sqrt_info;
    hosted_.inverse_depth = 0.3;
    hosted_.inverse_depth_sigma = 0.02;
    point_ = {0.11, -0.06, 0.28};
    for (int frame = 1; frame < 3; ++frame) {
      hosted_.seen.push_back({frame, {0.1, 0.05}, sqrt_info, 1, 0});
    }
  }

  double Cost(const Eigen::VectorXd& e, const RobustLoss& loss) const {
    std::vector<PosedCamera> cameras;
    for (int frame = 0; frame < 3; ++frame) {
      cameras.emplace_back(T_w_body_[frame].Plus(e.segment<6>(6 * frame)), T_body_cam_[frame]);
    }
    return hosted_.Cost(point_ + e.tail<3>(), cameras, kKappa + e[18], loss);
  }

  // The residuals, unweighted.
  Eigen::VectorXd Residuals(const Eigen::VectorXd& e) const {
    std::vector<PosedCamera> cameras;
    for (int frame = 0; frame < 3; ++frame) {
      cameras.emplace_back(T_w_body_[frame].Plus(e.segment<6>(6 * frame)), T_body_cam_[frame]);
    }
    const Eigen::Vector3d point = point_ + e.tail<3>();
    Eigen::VectorXd r(7);
    r << *hosted_.Residual(hosted_.seen[0], point, cameras),
        *hosted_.Residual(hosted_.seen[1], point, cameras),
        hosted_.sqrt_info * (point.head<2>() - hosted_.ray),
        hosted_.DepthResidual(point, kKappa + e[18]);
    return r;
  }

  EliminatedPoint Eliminated(const RobustLoss& loss, double damping) const {
    std::vector<PosedCamera> cameras;
    for (int frame = 0; frame < 3; ++frame) {
      cameras.emplace_back(T_w_body_[frame], T_body_cam_[frame]);
    }
    EliminatedPoint eliminated;
    Eliminate(hosted_, point_, cameras, kKappa, loss, damping, &eliminated);
    return eliminated;
  }

  static Eigen::VectorXd Gradient(const EliminatedPoint& eliminated) {
    Eigen::MatrixXd H = Eigen::MatrixXd::Zero(19, 19);
    Eigen::VectorXd g = Eigen::VectorXd::Zero(19);
    eliminated.AddTo(kColumns, &H, &g);
    return g;
  }

  inline static const std::vector<int> kColumns = {0, 6, 12, 18};  // three poses and kappa
  static constexpr double kKappa = 0.05;
  Random random_{1};
  std::vector<Rigid3> T_w_body_, T_body_cam_;
  HostedPoint hosted_;
  Eigen::Vector3d point_;
};

// The Schur complement of the residuals' numeric Jacobian, and the point's own step.
TEST_F(HostedPointTest, IsEliminatedAsDifferencesSay) {
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(kErrors);
  for (const RobustLoss loss : {RobustLoss{}, RobustLoss{RobustLoss::Kind::kHuber, 2.0},
                                RobustLoss{RobustLoss::Kind::kCauchy, 2.0}}) {
    Eigen::MatrixXd J =
        NumericJacobian(kErrors, 1e-6, [&](const Eigen::VectorXd& e) { return Residuals(e); });
    Eigen::VectorXd r = Residuals(zero);
    for (const int row : {0, 2}) {
      const double root = std::sqrt(loss.Weight(r.segment<2>(row).squaredNorm()));
      EXPECT_EQ(root < 1, loss.kind != RobustLoss::Kind::kNone);
      J.middleRows<2>(row) *= root;
      r.segment<2>(row) *= root;
    }
    constexpr double kDamping = 0.1;
    const Eigen::MatrixXd H = J.transpose() * J;
    const Eigen::VectorXd g = J.transpose() * r;
    Eigen::Matrix3d V = H.bottomRightCorner<3, 3>();
    V.diagonal() *= 1 + kDamping;
    const Eigen::MatrixXd W = H.bottomLeftCorner(3, 19);
    const EliminatedPoint eliminated = Eliminated(loss, kDamping);
    const Eigen::MatrixXd expected = H.topLeftCorner(19, 19) - W.transpose() * V.inverse() * W;
    EXPECT_LT((eliminated.Information() - expected).norm(), 1e-6 * expected.norm());
    const Eigen::VectorXd expected_g = g.head(19) - W.transpose() * V.inverse() * g.tail<3>();
    EXPECT_LT((Gradient(eliminated) - expected_g).norm(), 1e-6 * expected_g.norm());
    const Eigen::VectorXd e = Eigen::VectorXd::LinSpaced(19, -0.01, 0.02);
    const Eigen::Vector3d step = -V.inverse() * (g.tail<3>() + W * e);
    EXPECT_LT((eliminated.Step(kColumns, e) - step).norm(), 1e-6 * step.norm());
  }
}

// The weighted residuals' gradient is that of the cost.
TEST_F(HostedPointTest, CostHasTheGradient) {
  for (const RobustLoss loss : {RobustLoss{}, RobustLoss{RobustLoss::Kind::kHuber, 2.0},
                                RobustLoss{RobustLoss::Kind::kCauchy, 2.0}}) {
    const EliminatedPoint eliminated = Eliminated(loss, 0);
    const Eigen::VectorXd slope = NumericJacobian(kErrors, 1e-6, [&](const Eigen::VectorXd& e) {
                                    return Eigen::VectorXd::Constant(1, Cost(e, loss));
                                  }).transpose();
    const Eigen::Vector3d g_point = eliminated.L * eliminated.d;
    EXPECT_LT((slope.tail<3>() - g_point).norm(), 1e-5 * g_point.norm());
    EliminatedPoint as_it_is = eliminated;  // nothing of the point's gradient on the poses
    as_it_is.d.setZero();
    const Eigen::VectorXd g = Gradient(as_it_is);
    EXPECT_LT((slope.head(19) - g).norm(), 1e-5 * g.norm());
  }
}

TEST_F(HostedPointTest, BehindACameraThereIsNoResidual) {
  T_w_body_[2] = Rigid3(ExpSo3({3, 0, 0}), {0, 0, 0}) * T_w_body_[2];
  EXPECT_TRUE(std::isinf(Cost(Eigen::VectorXd::Zero(kErrors), {})));
}

TEST(PointObservation, JacobianOfBothDirections) {
  Random random(5);
  for (int run = 0; run < 100; ++run) {
    PointObservation observation;
    observation.direction = run % 2 == 0 ? Direction::kForward : Direction::kReverse;
    observation.T_cam_w = UniformPose(random, 2, 1);
    observation.R_cam_w = observation.T_cam_w.R();
    observation.ray = {0.1, 0.1};
    observation.sqrt_info << 400, 20, -10, 380;
    const Rigid3 T_m_c = UniformPose(random, 2, 1);
    const Rigid3 T_observer_holder =
        observation.direction == Direction::kForward ? T_m_c.Inverse() : T_m_c;
    const Eigen::Vector3d p_cam(Uniform(random, -1, 1), Uniform(random, -1, 1), 4);
    observation.p_w = T_observer_holder.Inverse() * (observation.T_cam_w.Inverse() * p_cam);
    observation.depth_sigma_w = UniformVector(random, 0.1);
    Eigen::Matrix<double, 2, 6> J;
    const auto at = Residual(observation, T_m_c, &J);
    ASSERT_TRUE(at);
    const Eigen::MatrixXd numeric = NumericJacobian(6, 1e-5, [&](const Vector6d& xi) {
      return Residual(observation, T_m_c.Plus(xi)).value().r;
    });
    for (int i = 0; i < 6; ++i) {
      EXPECT_LT((numeric - J).col(i).norm() / (1 + numeric.col(i).norm()), 1e-5);
    }
    // One sigma of depth moves the residual by depth_sigma.
    PointObservation moved = observation;
    moved.p_w += 1e-5 * observation.depth_sigma_w;
    EXPECT_LT(((Residual(moved, T_m_c)->r - at->r) / 1e-5 - at->depth_sigma).norm(),
              1e-2 * (1 + at->depth_sigma.norm()));
  }
}

}  // namespace
}  // namespace pangea
