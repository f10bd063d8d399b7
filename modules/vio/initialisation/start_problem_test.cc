// Tests the start's bundle adjustment: derivatives, covariance, and results.

#include "vio/initialisation/start_problem.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>

#include "core/imu/preintegration.h"
#include "core/testing/numeric_jacobian.h"
#include "core/testing/test_random.h"
#include "vio/initialisation/initial_solution.h"
#include "vio/initialisation/start_test_world.h"

namespace pangea::vio {
namespace {

using Eigen::MatrixXd;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr int kStartFrames = 6, kPoints = 12;

// All residuals are zero: rays without noise, and IMU factors that equal the states.
StartProblem ExactProblem(double stamp_sigma_s) {
  std::mt19937_64 rng(3);
  StartProblem problem;
  problem.T_body_cam = kT_body_cam;
  problem.ray_sigma = kStartRaySigma;
  problem.expected_gyro_bias = kGyroBias;
  problem.stamp_sigma_s = stamp_sigma_s;
  for (int i = 0; i < kStartFrames; ++i) {
    problem.stamps.push_back({RandomVector(rng, 1), 0});
    ImuState state;
    state.T_odom_body = Lively(1 + 0.1 * i);
    state.v_odom_body = VelocityAt(Lively, 1 + 0.1 * i);
    state.gyro_bias = kGyroBias;
    problem.states.push_back(state);
  }
  const StartWorld world = Record(Lively, 0, 0);
  for (int i = 0; i + 1 < kStartFrames; ++i) {
    Preintegrator integrator(ImuNoise{}, kGyroBias, Vector3d::Zero());
    integrator.Add(world.frames[i + 1].imu);
    Preintegration measured = integrator.result();
    const ImuState& from = problem.states[i];
    const ImuState& to = problem.states[i + 1];
    const double dt = measured.duration_s;
    const Vector3d gravity(0, 0, -kGravity);
    const Quaterniond q_body_odom = from.T_odom_body.q.conjugate();
    measured.delta_q = q_body_odom * to.T_odom_body.q;
    measured.delta_v = q_body_odom * (to.v_odom_body - from.v_odom_body - dt * gravity);
    measured.delta_p = q_body_odom * (to.T_odom_body.t - from.T_odom_body.t -
                                      dt * from.v_odom_body - 0.5 * dt * dt * gravity);
    problem.imu_factors.push_back(
        {measured, measured.covariance.llt().solve(Eigen::Matrix<double, 9, 9>::Identity())});
  }
  for (int k = 0; k < kPoints; ++k) {
    StartPoint point;
    point.p_odom = point.expected = Vector3d(5, 0, 0) + RandomVector(rng, 1);
    point.expected_sigma = 20;
    for (int i = k % 3; i < kStartFrames; ++i) {
      const Vector3d y = (problem.states[i].T_odom_body * kT_body_cam).Inverse() * point.p_odom;
      point.rays.push_back({i, y.head<2>() / y.z()});
    }
    problem.points.push_back(point);
  }
  return problem;
}

VectorXd RandomStep(const StartProblem& problem, double sigma) {
  std::mt19937_64 rng(5);
  VectorXd step(problem.size());
  for (double& one : step) {
    one = RandomVector(rng, sigma).x();
  }
  return step;
}

StartProblem Moved(const StartProblem& problem, const VectorXd& step) {
  StartProblem moved = problem;
  moved.Retract(problem.Linearise(0), step);
  return moved;
}

MatrixXd HessianOf(const StartProblem& problem) {
  return problem.Linearise(0).H.selfadjointView<Eigen::Lower>();
}

class StartProblemTest : public ::testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(StampSigmas, StartProblemTest, ::testing::Values(0, 0.002));

// With fixed points; some rays are beyond Huber's threshold.
TEST_P(StartProblemTest, GradientMatchesDifferencesOfTheCost) {
  const double stamp_sigma_s = GetParam();
  const StartProblem exact = ExactProblem(stamp_sigma_s);
  StartProblem problem = Moved(exact, RandomStep(exact, 0.003));
  for (StartPoint& point : problem.points) {
    point.p_odom += Vector3d(0.02, -0.03, 0.02);
  }
  const auto equations = problem.Linearise(0);
  VectorXd g = NumericJacobian(problem.size(), 1e-6, [&](const VectorXd& step) {
                 StartProblem moved = Moved(problem, step);
                 moved.points = problem.points;
                 return VectorXd::Constant(1, moved.Cost()).eval();
               }).transpose();
  // After elimination the gradient is g + gain^T g_point.
  for (int k = 0; k < kPoints; ++k) {
    const VectorXd g_point = NumericJacobian(3, 1e-6, [&](const VectorXd& step) {
                               StartProblem moved = problem;
                               moved.points[k].p_odom += step;
                               return VectorXd::Constant(1, moved.Cost()).eval();
                             }).transpose();
    const auto& elimination = equations.eliminations[k];
    g.segment(problem.PoseColumn(elimination.first_frame), elimination.gain.cols()) +=
        elimination.gain.transpose() * g_point;
  }
  const VectorXd scale = HessianOf(problem).diagonal().cwiseSqrt().cwiseInverse();
  const VectorXd scaled = scale.asDiagonal() * g;
  ASSERT_GT(scaled.cwiseAbs().maxCoeff(), 1);
  EXPECT_LT((scale.asDiagonal() * equations.g - scaled).cwiseAbs().maxCoeff(),
            1e-5 * scaled.cwiseAbs().maxCoeff());
}

// Without residuals the Gauss-Newton matrix is the Hessian: the derivative of the gradient with
// optimised points.
TEST_P(StartProblemTest, HessianMatchesDifferencesOfTheGradient) {
  const double stamp_sigma_s = GetParam();
  const StartProblem problem = ExactProblem(stamp_sigma_s);
  ASSERT_LT(problem.Cost(), 1e-12);
  MatrixXd H = HessianOf(problem);
  H.diagonal().segment<4>(problem.PoseColumn(0) + 2).array() -= 1e8;  // held, with no gradient
  const MatrixXd numeric = NumericJacobian(problem.size(), 1e-6, [&](const VectorXd& step) {
    return Moved(problem, step).Linearise(0).g;
  });
  const VectorXd scale = H.diagonal().cwiseSqrt().cwiseInverse();
  const MatrixXd error = scale.asDiagonal() * (H - numeric) * scale.asDiagonal();
  EXPECT_LT(error.cwiseAbs().maxCoeff(), 2e-4);
}

TEST_P(StartProblemTest, CovarianceIsThatOfTheNewestFrame) {
  const double stamp_sigma_s = GetParam();
  const StartProblem problem = ExactProblem(stamp_sigma_s);
  const ImuState& newest = problem.states.back();
  const MatrixXd J = NumericJacobian(problem.size(), 1e-6, [&](const VectorXd& step) {
    const StartProblem moved = Moved(problem, step);
    const ImuState& state = moved.states.back();
    VectorXd d(6);
    d << LogSo3(state.T_odom_body.q * newest.T_odom_body.q.conjugate()),
        state.v_odom_body - newest.v_odom_body;
    return d;
  });
  const MatrixXd H = HessianOf(problem);
  const MatrixXd expected =
      J * H.ldlt().solve(MatrixXd::Identity(problem.size(), problem.size())) * J.transpose();
  const auto covariance = problem.NewestCovariance();
  ASSERT_TRUE(covariance);
  EXPECT_LT((*covariance - expected).norm(), 1e-4 * expected.norm());
}

constexpr StartSigmas kSigmas = {.ray = kStartRaySigma};

TEST(Refine, ComesToTheSameFromAThirdOfTheScale) {
  const StartWorld world = Record(Lively, 0, kStartRaySigma);
  const auto start = SolveLinear(world.frames, kT_body_cam, ImuNoise{}, kGyroBias);
  ASSERT_TRUE(start);
  const auto refine = [&](double scale) {
    return Refine(world.frames, kT_body_cam, ImuNoise{}, kGyroBias, Scaled(*start, scale), kSigmas);
  };
  const auto from_whole = refine(1), from_third = refine(0.33);
  ASSERT_TRUE(from_whole && from_third);
  const Vector3d v = from_whole->states.back().v_odom_body;
  EXPECT_LT((v - from_third->states.back().v_odom_body).norm(), 0.05 * from_whole->velocity_sigma);
  EXPECT_NEAR(v.norm(), VelocityAt(Lively, 3).norm(), 4 * from_whole->velocity_sigma);
  EXPECT_GT(from_whole->inlier_share, 0.99);
  EXPECT_NEAR(from_whole->rms_sigma, 1, 0.1);
}

// Squared error of the newest velocity / variance in its least certain direction: 1 to 3 if the
// covariance is right.
double VelocityNees(double late_s, double stamp_sigma_s, const StartSigmas& sigmas) {
  constexpr int kSeeds = 10;
  double sum = 0;
  for (uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const StartWorld world = Record(Lively, late_s, kStartRaySigma, 0.1, seed, stamp_sigma_s);
    const auto start = SolveLinear(world.frames, kT_body_cam, ImuNoise{}, kGyroBias);
    const auto refined =
        start ? Refine(world.frames, kT_body_cam, ImuNoise{}, kGyroBias, *start, sigmas)
              : std::nullopt;
    EXPECT_TRUE(refined && !refined->states.empty()) << seed;
    if (refined && !refined->states.empty()) {
      // In the body frame: the yaw of odom is arbitrary.
      const Vector3d error =
          refined->states.back().T_odom_body.q.conjugate() * refined->states.back().v_odom_body -
          Lively(3).q.conjugate() * VelocityAt(Lively, 3);
      sum += error.squaredNorm() / (refined->velocity_sigma * refined->velocity_sigma) / kSeeds;
    }
  }
  return sum;
}

TEST(Refine, AllowsForStampsThatJitter) {
  StartSigmas allowing = kSigmas;
  allowing.stamp_s = 0.004;
  const double exact = VelocityNees(0, 0, kSigmas), jittering = VelocityNees(0, 0.004, allowing),
               not_allowed_for = VelocityNees(0, 0.004, kSigmas);
  std::cout << "NEES of the velocity: exact stamps " << exact << ", 4 ms of jitter " << jittering
            << ", not allowed for " << not_allowed_for << "\n";
  EXPECT_LT(jittering, 3);
  EXPECT_GT(not_allowed_for, 3 * jittering);
}

TEST(Refine, FindsTheTimeOffset) {
  constexpr double kLate_s = 0.008;
  StartSigmas exact_clocks = kSigmas;
  exact_clocks.time_offset_s = 1e-6;
  const double found = VelocityNees(kLate_s, 0, kSigmas),
               not_allowed_for = VelocityNees(kLate_s, 0, exact_clocks);
  std::cout << "NEES of the velocity, 8 ms late: " << found << ", not allowed for "
            << not_allowed_for << "\n";
  EXPECT_LT(found, 3);
  EXPECT_GT(not_allowed_for, 3 * found);
}

Rigid3 Forward(double t) {
  const Rigid3 T = Lively(t);
  return {T.q, T.t + Vector3d(1.5 * t, 0, 0)};
}

// A point that the closed form places just in front of one camera and behind the others has only
// one ray, so it does not move when that camera moves ahead.
TEST(Refine, APointThatCountsOneRayDoesNotHoldTheScale) {
  StartWorld world = Record(Forward, 0, kStartRaySigma);
  world.frames.resize(11);
  const auto start = SolveLinear(world.frames, kT_body_cam, ImuNoise{}, kGyroBias);
  ASSERT_TRUE(start);
  LinearStart third = Scaled(*start, 0.33);
  const auto velocity = [&] {
    const auto refined = Refine(world.frames, kT_body_cam, ImuNoise{}, kGyroBias, third, kSigmas);
    return refined ? refined->states.back().v_odom_body : Vector3d(Vector3d::Zero());
  };
  const Vector3d without = velocity();
  constexpr int kId = 1000, kFrame = 5;
  third.p_first[kId] = third.T_first_body[kFrame] * kT_body_cam * Vector3d(0.01, 0.01, 0.11);
  world.frames[kFrame].rays[kId] = {0.1, 0.1};
  EXPECT_LT((velocity() - without).norm(), 0.01 * without.norm());
}

TEST(Refine, DoesNotTryWithPointsBehindTheCamera) {
  const StartWorld world = Record(Lively, 0, kStartRaySigma);
  auto start = SolveLinear(world.frames, kT_body_cam, ImuNoise{}, kGyroBias);
  ASSERT_TRUE(start);
  for (auto& [id, p] : start->p_first) {
    p *= id % 3 == 0 ? -1 : 1;
  }
  const auto refined = Refine(world.frames, kT_body_cam, ImuNoise{}, kGyroBias, *start, kSigmas);
  ASSERT_TRUE(refined);
  EXPECT_NEAR(refined->inlier_share, 2.0 / 3, 0.02);
  EXPECT_TRUE(refined->states.empty());
}

TEST(Refine, ALargeAccelerometerBiasIsFoundWhereItIsExpected) {
  const Vector3d bias(0.6, -0.5, 0.4);
  StartWorld world = Record(Lively, 0, kStartRaySigma);
  for (StartFrame& frame : world.frames) {
    for (ImuSample& sample : frame.imu) {
      sample.accel += bias;
    }
  }
  const auto start = SolveLinear(world.frames, kT_body_cam, ImuNoise{}, kGyroBias);
  ASSERT_TRUE(start);
  const auto error = [&](double accel_bias_sigma) {
    const auto refined = Refine(world.frames, kT_body_cam, ImuNoise{}, kGyroBias, *start,
                                {.ray = kStartRaySigma, .accel_bias = accel_bias_sigma});
    return refined ? (refined->states.back().accel_bias - bias).norm() : 1e9;
  };
  EXPECT_LT(error(1), 0.5 * error(0.05));
}

Rigid3 Gentle(double t) {
  const Rigid3 T = Lively(t);
  return {T.q, 0.1 * T.t};
}

StartWorld GentleWithBias(const Vector3d& bias) {
  StartWorld world = Record(Gentle, 0, kStartRaySigma);
  for (StartFrame& frame : world.frames) {
    for (ImuSample& sample : frame.imu) {
      sample.accel += bias;
    }
  }
  return world;
}

// With a large bias and little motion the closed-form scale is several times too large.
TEST(Refine, AMinimumOfAnotherScaleIsNotTaken) {
  const StartWorld world = GentleWithBias({0.3, -0.3, 0.2});
  const auto start = SolveLinear(world.frames, kT_body_cam, ImuNoise{}, kGyroBias);
  ASSERT_TRUE(start);
  const LinearStart too_large = Scaled(*start, 2.5);
  const auto refine = [&](const LinearStart& from) {
    return Refine(world.frames, kT_body_cam, ImuNoise{}, kGyroBias, from, kSigmas);
  };
  const auto first = refine(too_large);
  ASSERT_TRUE(first);
  const double truth = VelocityAt(Gentle, 3).norm();
  std::cout << first->states.back().v_odom_body.norm() << " of " << truth << " m/s\n";
  EXPECT_GT(first->states.back().v_odom_body.norm(), 3 * truth);
  const RefinedStart best = BestOfScales(refine, too_large, *first);
  EXPECT_NEAR(best.states.back().v_odom_body.norm(), truth, 4 * best.velocity_sigma);
}

TEST(Refine, AStartWithANegativeScaleIsMirrored) {
  const StartWorld world = GentleWithBias({0, 0, -0.15});
  auto start = SolveLinear(world.frames, kT_body_cam, ImuNoise{}, kGyroBias);
  ASSERT_TRUE(start);
  const auto refine = [&](const LinearStart& from) {
    return Refine(world.frames, kT_body_cam, ImuNoise{}, kGyroBias, from, kSigmas);
  };
  const auto direct = refine(*start);
  ASSERT_TRUE(direct);
  ASSERT_EQ(direct->inlier_share, 0);
  const auto mirrored = RefineInFront(refine, &*start);
  ASSERT_TRUE(mirrored && !mirrored->states.empty());
  EXPECT_GT(mirrored->inlier_share, 0.99);
  EXPECT_NEAR(mirrored->states.back().v_odom_body.norm(), VelocityAt(Gentle, 3).norm(),
              4 * mirrored->velocity_sigma);
}

MovingStart StartWithBias(const StartWorld& world, const Vector3d& gyro_bias) {
  const auto linear = SolveLinear(world.frames, kT_body_cam, ImuNoise{}, gyro_bias);
  const RefineFrom refine = [&world, gyro_bias](const LinearStart& from) {
    return Refine(world.frames, kT_body_cam, ImuNoise{}, gyro_bias, from, kSigmas);
  };
  return {refine, linear.value(), refine(linear.value())};
}

TEST(BetterOf, AFalseGyroBiasHasTheHigherCost) {
  const StartWorld world = Record(Lively, 0, kStartRaySigma);
  const Vector3d false_bias = kGyroBias + Vector3d(0.06, 0, -0.04);
  for (const bool swapped : {false, true}) {
    const auto start = BetterOf(StartWithBias(world, swapped ? false_bias : kGyroBias),
                                StartWithBias(world, swapped ? kGyroBias : false_bias));
    ASSERT_TRUE(start && start->refined);
    EXPECT_LT((start->refined->states.back().gyro_bias - kGyroBias).norm(), 2e-3) << swapped;
  }
}

TEST(BetterOf, TakesTheOneThatThereIs) {
  const StartWorld world = Record(Lively, 0, kStartRaySigma);
  EXPECT_TRUE(BetterOf(std::nullopt, StartWithBias(world, kGyroBias)));
  EXPECT_TRUE(BetterOf(StartWithBias(world, kGyroBias), std::nullopt));
  MovingStart not_refined = StartWithBias(world, kGyroBias);
  not_refined.refined.reset();
  EXPECT_TRUE(BetterOf(not_refined, StartWithBias(world, kGyroBias))->refined);
}

}  // namespace
}  // namespace pangea::vio
