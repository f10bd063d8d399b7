#include "posegraph/odometry_chain.h"

#include <gtest/gtest.h>

#include <cmath>

namespace pangea {
namespace {

constexpr double kSigma_m = 0.02, kSigmaYaw = 0.01;  // of each step
const Eigen::Vector3d kStep(0.3, 0.4, 0);            // metres, the same in body and odom

Keyframe Along(int seq) {
  Keyframe keyframe;
  keyframe.id = {{1, 1000}, seq};
  keyframe.T_odom_body.t = seq * kStep;
  keyframe.roll_pitch_covariance.setZero();
  Vector6d variances;
  variances << Eigen::Vector3d::Constant(kSigma_m * kSigma_m), 1e-12, 1e-12, kSigmaYaw * kSigmaYaw;
  keyframe.edge =
      OdometryEdge{seq - 1, {Eigen::Quaterniond::Identity(), kStep}, variances.asDiagonal()};
  return keyframe;
}

// The covariance of a gap is that of the missing steps: each step's own error, and the effect of
// its rotation on all later ones.
TEST(OdometryChain, AGapIsAsUncertainAsItsSteps) {
  constexpr int kFrom = 60, kSteps = 9;
  OdometryChain chain;
  for (int seq = 0; seq <= kFrom; ++seq) {
    ASSERT_TRUE(chain.Add(Along(seq)));
  }
  EXPECT_EQ(chain.num_bridged(), 0);
  ASSERT_TRUE(chain.Add(Along(kFrom + kSteps)));
  EXPECT_EQ(chain.num_bridged(), 1);
  const OdometryChain::Node& node = chain[chain.size() - 1];
  EXPECT_LT((node.edge.t - kSteps * kStep).norm(), 1e-9);
  EXPECT_EQ(node.edge.yaw, 0);

  Matrix4d steps = Matrix4d::Zero();
  for (int after = 0; after < kSteps; ++after) {  // steps that follow
    Matrix4d J = Matrix4d::Identity();            // d(t, yaw)/d(this step's)
    J.topRightCorner<3, 1>() = after * Eigen::Vector3d(-kStep.y(), kStep.x(), 0);
    Vector4d variances = Vector4d::Constant(kSigma_m * kSigma_m);
    variances[3] = kSigmaYaw * kSigmaYaw;
    steps += J * variances.asDiagonal() * J.transpose();
  }
  // The bridge treats every rotation as if it were at the middle of the gap.
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) {
      EXPECT_NEAR(node.edge.covariance(i, j), steps(i, j),
                  0.15 * std::sqrt(steps(i, i) * steps(j, j)))
          << i << ", " << j;
    }
  }
}

// An edge may begin further back than at the newest keyframe. Then the drift between the newest
// keyframe and this one would be a difference of two edges that both begin there, in either sign.
TEST(OdometryChain, DriftIsNeverNegative) {
  OdometryChain chain;
  for (int seq = 0; seq < 5; ++seq) {
    Keyframe keyframe = Along(seq);
    if (seq == 4) {
      keyframe.edge->from_seq = 2;
      keyframe.edge->T_from_this.t = 2 * kStep;
      keyframe.edge->covariance *= 0.01;
    }
    ASSERT_TRUE(chain.Add(keyframe));
  }
  const Matrix4d drift = chain.DriftBetween(3, 4, chain[4].T_odom_body.t);
  EXPECT_GT(drift(0, 0), 0);
  EXPECT_GT(drift(3, 3), 0);
  EXPECT_NEAR(chain.PathBetween(3, 4), kStep.norm(), 1e-9);
}

// However many keyframes of a map are lost, a step is as uncertain as a step.
TEST(OdometryChain, GapsDoNotMakeLaterGapsMoreUncertain) {
  constexpr int kBegin = 20, kGaps = 300;
  OdometryChain chain;
  for (int seq = 0; seq <= kBegin; ++seq) {
    ASSERT_TRUE(chain.Add(Along(seq)));
  }
  for (int gap = 1; gap <= kGaps; ++gap) {
    ASSERT_TRUE(chain.Add(Along(kBegin + 2 * gap)));
  }
  ASSERT_EQ(chain.num_bridged(), kGaps);
  const Matrix4d& covariance = chain[chain.size() - 1].edge.covariance;
  EXPECT_NEAR(covariance(3, 3), 2 * kSigmaYaw * kSigmaYaw, 0.2 * kSigmaYaw * kSigmaYaw);
  EXPECT_NEAR(covariance(0, 0), 2 * kSigma_m * kSigma_m, 0.5 * kSigma_m * kSigma_m);
}

// An odometry that was lost for a moment may say so with any variance.
TEST(OdometryChain, OneVagueEdgeDoesNotHideTheLaterOnes) {
  constexpr int kVague = 100;
  OdometryChain chain, certain;
  for (int seq = 0; seq < 2 * kVague; ++seq) {
    Keyframe keyframe = Along(seq);
    certain.Add(keyframe);
    if (seq == kVague) {
      keyframe.edge->covariance = 1e12 * Matrix6d::Identity();
    }
    ASSERT_TRUE(chain.Add(keyframe));
  }
  const Eigen::Vector3d& end = chain[2 * kVague - 1].T_odom_body.t;
  const Matrix4d later = chain.DriftBetween(kVague, 2 * kVague - 1, end);
  EXPECT_TRUE(later.isApprox(certain.DriftBetween(kVague, 2 * kVague - 1, end), 1e-6)) << later;
  const Matrix4d vague = chain.DriftBetween(kVague - 1, kVague, chain[kVague].T_odom_body.t);
  EXPECT_GT(vague(0, 0), 1000);  // m^2
  EXPECT_GT(vague(3, 3), 3);     // rad^2
}

// An agent that stands still at the start sends keyframes before it knows any depth.
TEST(OdometryChain, KeyframesThatDoNotKnowTheScaleYetDoNotMakeTheMapMetric) {
  OdometryChain chain;
  int seq = 0;
  for (const double sigma : {0.0, 0.0, 0.0, 0.0, 0.2, 0.3, 0.2}) {
    Keyframe keyframe = Along(seq++);
    keyframe.scale_sigma = sigma;
    chain.Add(keyframe);
    EXPECT_EQ(chain.UnknownScale(), seq < 5 ? 0 : seq == 6 ? 0.3 : 0.2) << seq;
  }
}

}  // namespace
}  // namespace pangea
