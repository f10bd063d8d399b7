#include "global_ba/ba_factors.h"

#include <gtest/gtest.h>

#include <random>

#include "core/testing/numeric_jacobian.h"
#include "core/testing/test_random.h"
#include "global_ba/ba_test_world.h"

namespace pangea {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

// Pose and motion together, displaced by an offset in their tangents.
struct Blocks {
  Rigid3 pose;
  MotionBlock motion;

  explicit Blocks(const KeyframeState& state) : pose(state.T_map_body) {
    motion << state.v_map_body, state.gyro_bias, state.accel_bias;
  }
  void Write(const VectorXd& offset, double* pose_block, double* motion_block) const {
    PoseToBlock(pose.Plus(offset.head<6>()), pose_block);
    Eigen::Map<MotionBlock> moved(motion_block);
    moved = motion + offset.tail<9>();
  }
};

TEST(CameraPriorFactor, DerivativesMatchDifferences) {
  std::mt19937_64 rng(2);
  const Rigid3 prior = RandomPose(rng, 1, 3);
  Vector6d off;
  off << 0.1, -0.2, 0.3, 0.4, -0.3, 0.2;
  const Rigid3 at = prior.Plus(off);
  const CameraPriorFactor factor(prior, 0.1, 0.2);
  double block[7];
  const auto evaluate = [&](const VectorXd& offset, double** jacobians) {
    PoseToBlock(at.Plus(offset), block);
    const double* const blocks[] = {block};
    VectorXd r(6);
    EXPECT_TRUE(factor.Evaluate(blocks, r.data(), jacobians));
    return r;
  };
  Eigen::Matrix<double, 6, 7, Eigen::RowMajor> J;
  double* jacobians[] = {J.data()};
  const VectorXd r = evaluate(VectorXd::Zero(6), jacobians);
  EXPECT_LT((r.head<3>() - off.head<3>() / 0.1).norm(), 1e-9);
  EXPECT_LT((r.tail<3>() - off.tail<3>() / 0.2).norm(), 1e-9);
  const MatrixXd numeric = NumericJacobian(
      6, 1e-6, [&](const VectorXd& offset) -> VectorXd { return evaluate(offset, nullptr); });
  EXPECT_LT((J.leftCols<6>() - numeric).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(PreintegrationFactor, DerivativesMatchDifferencesInEveryBlock) {
  const BaTestWorld world = MakeBaTestWorld({.agents = 1, .keyframes = 8, .landmarks = 1});
  for (size_t i = 1; i < world.start.keyframes.size(); ++i) {
    const BaKeyframe& to = world.start.keyframes[i];
    const Blocks first(world.start.keyframes[i - 1].state), second(to.state);
    const PreintegrationFactor factor(*to.preintegration, ImuNoise{});
    double pose_a[7], motion_a[9], pose_b[7], motion_b[9];
    const auto evaluate = [&](const VectorXd& offset, double** jacobians) {
      first.Write(offset.head<15>(), pose_a, motion_a);
      second.Write(offset.tail<15>(), pose_b, motion_b);
      const double* const blocks[] = {pose_a, motion_a, pose_b, motion_b};
      VectorXd r(15);
      EXPECT_TRUE(factor.Evaluate(blocks, r.data(), jacobians));
      return r;
    };
    Eigen::Matrix<double, 15, 7, Eigen::RowMajor> J_pose_a, J_pose_b;
    Eigen::Matrix<double, 15, 9, Eigen::RowMajor> J_motion_a, J_motion_b;
    double* jacobians[] = {J_pose_a.data(), J_motion_a.data(), J_pose_b.data(), J_motion_b.data()};
    evaluate(VectorXd::Zero(30), jacobians);
    MatrixXd J(15, 30);
    J << J_pose_a.leftCols<6>(), J_motion_a, J_pose_b.leftCols<6>(), J_motion_b;
    const MatrixXd numeric = NumericJacobian(
        30, 1e-5, [&](const VectorXd& offset) -> VectorXd { return evaluate(offset, nullptr); });
    for (int column = 0; column < 30; ++column) {
      EXPECT_LT((J.col(column) - numeric.col(column)).cwiseAbs().maxCoeff(),
                1e-6 * numeric.cwiseAbs().maxCoeff())
          << "keyframe " << i << ", column " << column;
    }
  }
}

// Noisy samples and random-walk biases: at the truth the whitened residual is chi-squared with 15
// degrees of freedom per span. In long spans the walk of the biases within the span dominates.
TEST(PreintegrationFactor, IsChiSquaredAtTheTruth) {
  for (const double step_s : {0.5, 2.0}) {
    double sum = 0, degrees = 0;
    for (uint64_t seed = 1; seed <= 5; ++seed) {
      const BaWorld truth =
          MakeBaTestWorld({.seed = seed, .keyframes = 30, .step_s = step_s, .landmarks = 1}).truth;
      for (const BaKeyframe& to : truth.keyframes) {
        if (to.previous < 0) {
          continue;
        }
        double pose_a[7], motion_a[9], pose_b[7], motion_b[9];
        Blocks(truth.keyframes[to.previous].state).Write(VectorXd::Zero(15), pose_a, motion_a);
        Blocks(to.state).Write(VectorXd::Zero(15), pose_b, motion_b);
        const double* const blocks[] = {pose_a, motion_a, pose_b, motion_b};
        VectorXd r(15);
        EXPECT_TRUE(PreintegrationFactor(*to.preintegration, ImuNoise{})
                        .Evaluate(blocks, r.data(), nullptr));
        sum += r.squaredNorm();
        degrees += 15;
      }
    }
    // The minimum covariances of the integration reduce it slightly
    EXPECT_NEAR(sum / degrees, 1, 0.1) << step_s;
  }
}

TEST(BiasPriorFactor, IsOneAtOneSigmaAndItsDerivativeMatches) {
  const BiasPriorFactor factor(0.05, 0.15);
  const auto evaluate = [&](const VectorXd& motion, double** jacobians) {
    const double* const blocks[] = {motion.data()};
    VectorXd r(6);
    EXPECT_TRUE(factor.Evaluate(blocks, r.data(), jacobians));
    return r;
  };
  VectorXd at(9);
  at << 1, 2, 3, 0.05, 0.05, 0.05, 0.15, 0.15, 0.15;
  Eigen::Matrix<double, 6, 9, Eigen::RowMajor> J;
  double* jacobians[] = {J.data()};
  EXPECT_LT((evaluate(at, jacobians) - VectorXd::Ones(6)).norm(), 1e-12);
  const MatrixXd numeric = NumericJacobian(9, 1e-6, [&](const VectorXd& offset) -> VectorXd {
    return evaluate(VectorXd(at + offset), nullptr);
  });
  EXPECT_LT((J - numeric).cwiseAbs().maxCoeff(), 1e-6);
}

}  // namespace
}  // namespace pangea
