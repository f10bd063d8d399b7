#include "vio/window/window_problem.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/testing/numeric_jacobian.h"
#include "vio/window/testing/window_test_world.h"
#include "vio/window/window_factors.h"
#include "vio/window/window_start.h"

namespace pangea::vio {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// Noisy rays; the factors take every second pair of frames as stationary.
WindowProblem NoisyWindow(uint64_t seed) {
  WindowTestOptions options;
  options.seed = seed;
  options.ray_noise = 1;
  options.stamp_sigma_s = seed % 2 == 0 ? 0.004 : 0;
  WindowProblem problem = TestWindow(options);
  problem.state.frames[1].stationary = problem.state.frames[2].stationary = true;
  return problem;
}

// Moves the landmarks to their optimum for the fixed window.
void SettleLandmarks(WindowProblem* problem) {
  for (int iteration = 0; iteration < 40; ++iteration) {
    const NormalEquations equations = Linearise(*problem, 0);
    for (size_t l = 0; l < problem->landmarks.size(); ++l) {
      problem->landmarks[l].point.ray_rho += equations.eliminations[l].offset;
    }
  }
}

VectorXd CostAlong(WindowProblem problem, const WindowState& state) {
  problem.state = state;
  return VectorXd::Constant(1, Cost(problem));
}

MatrixXd Scaled(const MatrixXd& H, const VectorXd& scale) {
  return scale.asDiagonal() * H * scale.asDiagonal();
}
VectorXd ScaleOf(const MatrixXd& H) { return H.diagonal().cwiseSqrt().cwiseInverse(); }

TEST(WindowState, DifferenceUndoesRetract) {
  WindowProblem problem = TestWindow({});
  problem.state.frames[0].pose_only = true;
  const VectorXd error = RandomError(problem.state, 0.1, 1);
  WindowState moved = problem.state;
  moved.Retract(error);
  EXPECT_LT((Difference(moved, problem.state) - error).norm(), 1e-12);
}

// With the landmarks at their optimum, the gradients of the reduced and of the whole cost are
// equal.
TEST(WindowProblem, TheGradientMatchesDifferences) {
  for (uint64_t seed = 1; seed <= 3; ++seed) {
    WindowProblem problem = NoisyWindow(seed);
    problem.state.Retract(RandomError(problem.state, 1e-3, seed));
    problem.prior.at = problem.state;
    problem.prior.g = RandomError(problem.state, 100, seed + 10);
    SettleLandmarks(&problem);
    // One ray pulls with constant force.
    problem.landmarks[0].rays.back().ray.x() += 20 * problem.landmarks[0].rays.back().sigma;
    SettleLandmarks(&problem);
    const NormalEquations equations = Linearise(problem, 0);
    EXPECT_NEAR(equations.cost, Cost(problem), 1e-9 * equations.cost);
    const VectorXd scale = ScaleOf(equations.H);
    const VectorXd numeric = NumericJacobian(problem.state, [&](const WindowState& state) {
                               return CostAlong(problem, state);
                             }).transpose();
    EXPECT_LT((scale.asDiagonal() * (equations.g - numeric)).cwiseAbs().maxCoeff(),
              1e-5 * (scale.asDiagonal() * equations.g).norm())
        << "seed " << seed;
  }
}

// If all residuals vanish, Gauss-Newton is exact: H is the derivative of the reduced gradient.
TEST(WindowProblem, TheInformationMatchesDifferences) {
  WindowProblem problem = TestWindow({});
  // A stationary window also has zero residuals.
  for (WindowFrame& frame : problem.state.frames) {
    frame.stationary = true;
    frame.imu = problem.state.frames[0].imu;
    frame.imu.v_odom_body.setZero();
  }
  for (auto& factor : problem.imu_factors) {
    factor.reset();
  }
  problem.landmarks.clear();
  problem.imu_factors[1] = ImuFactor{};  // no information, but it makes the two frames neighbours
  problem.imu_factors[1]->information.setZero();
  const WindowProblem standing = problem;
  const WindowProblem moving = TestWindow({});
  // Jittering stamps with zero residuals, and no time ahead in which the velocity would count.
  WindowProblem jittering = TestWindow({.stamp_sigma_s = 1e-9});
  for (WindowFrame& frame : jittering.state.frames) {
    frame.stamp_sigma_s *= 1e6;
  }
  for (const WindowProblem& each : {standing, moving, jittering}) {
    const NormalEquations equations = Linearise(each, 0);
    const MatrixXd numeric = NumericJacobian(each.state, [&](const WindowState& state) -> VectorXd {
      WindowProblem moved = each;
      moved.state = state;
      SettleLandmarks(&moved);
      return Linearise(moved, 0).g;
    });
    const VectorXd scale = equations.H.diagonal().cwiseMax(1e-6).cwiseSqrt().cwiseInverse();
    EXPECT_LT(Scaled(equations.H - numeric, scale).cwiseAbs().maxCoeff(), 1e-4);
  }
}

void ExpectNothingKnown(const MatrixXd& H, const VectorXd& g, const WindowState& state) {
  const MatrixXd N = UnobservableDirections(state);
  // Relative to the information of each row: |H| |N|.
  const MatrixXd size = H.cwiseAbs() * N.cwiseAbs() + MatrixXd::Constant(N.rows(), 4, 1e-6);
  EXPECT_LT((H * N).cwiseQuotient(size).cwiseAbs().maxCoeff(), 2e-8);
  const VectorXd g_size = N.cwiseAbs().transpose() * g.cwiseAbs();
  EXPECT_LT((N.transpose() * g).cwiseQuotient(g_size).cwiseAbs().maxCoeff(), 1e-8);
}

TEST(WindowProblem, PositionAndYawAreNotObservedAnywhere) {
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    WindowProblem problem = NoisyWindow(seed);
    problem.state.Retract(RandomError(problem.state, 0.03, seed));
    const NormalEquations equations = Linearise(problem, 0);
    ExpectNothingKnown(equations.H, equations.g, problem.state);
  }
}

// ... nor after frames are marginalised at one point and the rest is linearised at another.
TEST(WindowProblem, MarginalisationLearnsNothingOfPositionAndYaw) {
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    for (const bool keep_pose : {false, true}) {
      WindowProblem problem = NoisyWindow(seed);
      for (int round = 0; round < 2; ++round) {
        problem.state.Retract(RandomError(problem.state, 0.02, seed + round));
        MarginaliseOldest(problem, {.keep_pose = keep_pose, .drop_kept_pose = true});
        ExpectNothingKnown(problem.prior.H, problem.prior.g, problem.prior.at);
      }
      problem.state.Retract(RandomError(problem.state, 0.02, seed + 5));
      const NormalEquations equations = Linearise(problem, 0);
      const MatrixXd N = UnobservableDirections(problem.state);
      const MatrixXd size = equations.H.cwiseAbs() * N.cwiseAbs();
      EXPECT_LT((equations.H * N).cwiseQuotient(size).cwiseAbs().maxCoeff(), 1e-8);
    }
  }
}

// The rows of a window that are left when the oldest full frame is marginalised.
std::vector<int> RowsLeft(const WindowState& state, const Marginalisation& what) {
  const int oldest = state.frames[0].pose_only ? 1 : 0;
  std::vector<int> rows;
  for (int i = 0; i < state.size(); ++i) {
    const int kept = oldest == 1 ? kPoseSize : 0;
    const int in_kept = i - kSharedSize, in_oldest = i - kSharedSize - kept;
    const bool goes = (in_kept >= 0 && in_kept < kept)
                          ? what.drop_kept_pose
                          : in_oldest >= 0 && in_oldest < state.frames[oldest].size() &&
                                !(what.keep_pose && in_oldest < kPoseSize);
    if (!goes) {
      rows.push_back(i);
    }
  }
  return rows;
}

MatrixXd Covariance(const WindowProblem& problem) {
  std::vector<int> rows(problem.state.size());
  std::iota(rows.begin(), rows.end(), 0);
  return WindowCovariance(problem, rows);
}

VectorXd Solution(const WindowProblem& problem) {
  return -Covariance(problem) * Linearise(problem, 0).g;
}

void ExpectTheSameOfTheRest(const WindowProblem& before, const WindowProblem& after,
                            const std::vector<int>& rows) {
  const MatrixXd P = Covariance(before);
  const MatrixXd P_left = P(rows, rows);
  const VectorXd scale = ScaleOf(P_left);
  ASSERT_EQ(after.state.size(), P_left.rows());
  EXPECT_LT(Scaled(Covariance(after) - P_left, scale).cwiseAbs().maxCoeff(), 1e-5);
  const VectorXd x_left = Solution(before)(rows);
  const VectorXd difference = scale.asDiagonal() * (Solution(after) - x_left);
  EXPECT_LT(difference.cwiseAbs().maxCoeff(), 1e-5 * (1 + (scale.asDiagonal() * x_left).norm()));
}

TEST(WindowProblem, WhatIsLeftKnowsAsMuchAsTheWhole) {
  const Marginalisation kAll{}, kAllButPose{.keep_pose = true};
  const Marginalisation kAllKeptToo{.keep_pose = false, .drop_kept_pose = true};
  const Marginalisation kNextPose{.keep_pose = true, .drop_kept_pose = true};
  for (const auto& rounds :
       {std::vector{kAll, kAll}, std::vector{kAllButPose, kAll},
        std::vector{kAllButPose, kAllKeptToo}, std::vector{kAllButPose, kNextPose}}) {
    WindowProblem problem = NoisyWindow(2);
    HoldStart(&problem, 0.01);
    problem.state.Retract(RandomError(problem.state, 1e-3, 7));
    problem.prior.at = problem.state;
    for (const Marginalisation& what : rounds) {
      const WindowProblem before = problem;
      MarginaliseOldest(problem, what);
      ExpectTheSameOfTheRest(before, problem, RowsLeft(before.state, what));
    }
  }
}

TEST(WindowProblem, FramesImuFactorsAndRaysFollowAMarginalisation) {
  WindowProblem problem = TestWindow({});
  const WindowProblem before = problem;
  MarginaliseOldest(problem, {.keep_pose = true});
  ASSERT_EQ(problem.state.frames.size(), 5u);
  EXPECT_TRUE(problem.state.frames[0].pose_only);
  EXPECT_FALSE(problem.imu_factors[0] || problem.imu_factors[1]);
  EXPECT_TRUE(problem.imu_factors[2]);
  EXPECT_EQ(problem.landmarks.size(), 9u);  // a quarter was anchored in the removed frame

  MarginaliseOldest(problem, {.drop_kept_pose = true});
  ASSERT_EQ(problem.state.frames.size(), 3u);
  ASSERT_EQ(problem.imu_factors.size(), 3u);
  EXPECT_EQ(problem.state.frames[0].utime, before.state.frames[2].utime);
  EXPECT_FALSE(problem.imu_factors[0]);
  ASSERT_EQ(problem.landmarks.size(), 6u);
  for (const Landmark& landmark : problem.landmarks) {
    const Landmark& as_before = before.landmarks[landmark.id];
    EXPECT_EQ(landmark.point.anchor, as_before.point.anchor - 2);
    ASSERT_EQ(landmark.rays.size(), as_before.rays.size());
    for (size_t i = 0; i < landmark.rays.size(); ++i) {
      EXPECT_EQ(landmark.rays[i].frame, as_before.rays[i].frame - 2);
    }
  }
}

// A perturbed window and its truth; the start is fixed at the truth.
struct Perturbed {
  WindowProblem truth, problem;
};
Perturbed Perturb(uint64_t seed, double sigma, double rho_factor, double stamp_sigma_s) {
  WindowTestOptions options;
  options.seed = seed;
  options.landmarks = 40;
  options.stamp_sigma_s = stamp_sigma_s;
  Perturbed out;
  out.truth = TestWindow(options);
  for (WindowFrame& frame : out.truth.state.frames) {
    frame.stamp_sigma_s *= 1e6;  // the truth must have zero cost
  }
  HoldStart(&out.truth, 1e-3);
  out.problem = out.truth;
  out.problem.state.Retract(RandomError(out.truth.state, sigma, seed));
  for (Landmark& landmark : out.problem.landmarks) {
    landmark.point.ray_rho.z() *= rho_factor;
  }
  return out;
}

void ExpectTruth(const Perturbed& window) {
  EXPECT_LT(Difference(window.problem.state, window.truth.state).cwiseAbs().maxCoeff(), 1e-5);
  for (size_t l = 0; l < window.truth.landmarks.size(); ++l) {
    EXPECT_LT((window.problem.landmarks[l].point.ray_rho - window.truth.landmarks[l].point.ray_rho)
                  .norm(),
              1e-5);
  }
}

TEST(Optimise, FindsBackFromAPerturbation) {
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    Perturbed window = Perturb(seed, 0.02, 1.1, seed % 2 == 0 ? 0.004 : 0);
    const double cost = Optimise(window.problem, 10);
    EXPECT_LT(cost, 1e-4) << "seed " << seed;
    EXPECT_NEAR(cost, Cost(window.problem), 1e-9);
    ExpectTruth(window);
  }
}

// The undamped Gauss-Newton step.
WindowProblem FullStep(const WindowProblem& problem) {
  WindowProblem moved = problem;
  const NormalEquations equations = Linearise(problem, 0);
  const VectorXd step = Solution(problem);
  for (size_t l = 0; l < moved.landmarks.size(); ++l) {
    Landmark& landmark = moved.landmarks[l];
    const NormalEquations::Elimination& elimination = equations.eliminations[l];
    VectorXd own(elimination.gain.cols());
    own.head(kCalibrationSize) = step.head(kCalibrationSize);
    for (size_t j = 0; j < landmark.rays.size(); ++j) {
      own.segment<kPoseSize>(elimination.RayColumn(j)) =
          step.segment<kPoseSize>(problem.state.FirstRow(landmark.rays[j].frame));
      if (elimination.stamps && problem.state.frames[landmark.rays[j].frame].has_stamp_error()) {
        own[elimination.RayColumn(j) + kPoseSize] =
            step[problem.state.FirstRow(landmark.rays[j].frame) + kStampError];
      }
    }
    landmark.point.ray_rho += elimination.offset + elimination.gain * own;
  }
  moved.state.Retract(step);
  return moved;
}

// Points start at ten times their distance, and no inertial measurement constrains the frames.
TEST(Optimise, DampsWhenTheFullStepIsWorse) {
  int worse = 0;
  for (uint64_t seed = 1; seed <= 50; ++seed) {
    Perturbed window = Perturb(seed, 0.1, 0.1, 0);
    std::fill(window.problem.imu_factors.begin(), window.problem.imu_factors.end(), std::nullopt);
    window.problem.prior.H =
        100 * MatrixXd::Identity(window.problem.state.size(), window.problem.state.size());
    window.problem.state.intrinsics = window.truth.state.intrinsics;  // they are known
    window.problem.state.imu_intrinsics = window.truth.state.imu_intrinsics;
    window.problem.prior.H.diagonal().segment<kIntrinsicsSize>(kIntrinsics).setConstant(1e8);
    const double start = Cost(window.problem);
    worse += Cost(FullStep(window.problem)) > start ? 1 : 0;
    WindowProblem once = window.problem;
    Optimise(once, 1);
    EXPECT_LT(Cost(once), start) << "seed " << seed;
    EXPECT_LT(Optimise(window.problem, 50), 0.02) << "seed " << seed;  // the truth has zero cost
  }
  EXPECT_GT(worse, 0);
}

TEST(StartPrior, IsTheInitialisersCovarianceInTheWindowsCoordinates) {
  WindowTestOptions options;
  options.frames = 1;
  options.landmarks = 0;
  WindowState start = TestWindow(options).state;
  const VectorXd spread = RandomError(start, 0.05, 3).tail(kFrameSize);
  const Eigen::Matrix<double, 15, 15> plain =
      spread * spread.transpose() + 1e-2 * Eigen::Matrix<double, 15, 15>::Identity();
  const WindowPrior prior = StartPrior(start, plain, CameraModel{}, {}, ImuNoise{});
  const MatrixXd P = prior.H.inverse();
  // Errors drawn in the initialiser's coordinates, converted to the window's: p + dp = Exp(dtheta)
  // p + xi.
  const MatrixXd J = pangea::NumericJacobian(15, 1e-6, [&](const VectorXd& d) -> VectorXd {
    WindowState moved = start;
    ImuState& imu = moved.frames[0].imu;
    imu.T_odom_body.q = ExpSo3(d.head<3>()) * imu.T_odom_body.q;
    imu.T_odom_body.t += d.segment<3>(kPosition);
    imu.v_odom_body += d.segment<3>(kVelocity);
    imu.gyro_bias += d.segment<3>(kGyroBias);
    imu.accel_bias += d.segment<3>(kAccelBias);
    return Difference(moved, start).tail(kFrameSize);
  });
  const MatrixXd expected = J * plain * J.transpose();
  EXPECT_LT((P.bottomRightCorner(15, 15) - expected).cwiseAbs().maxCoeff(), 1e-5);
  EXPECT_NEAR(std::sqrt(P(kImuIntrinsics, kImuIntrinsics)), 0.002, 1e-7);  // the gyro's x by x
  EXPECT_NEAR(std::sqrt(P(kImuIntrinsics + 9, kImuIntrinsics + 9)), 0.001,
              1e-7);  // the accelerometer's
  // The gyro's y by x and x by y are equal, as the gyro is not rotated relative to the body. Their
  // former antisymmetric part rotates the accelerometer instead.
  const double variance = 0.002 * 0.002;
  EXPECT_NEAR(P(kImuIntrinsics + 1, kImuIntrinsics + 1), 0.5 * variance, 1e-9);
  EXPECT_NEAR(P(kImuIntrinsics + 1, kImuIntrinsics + 3), 0.5 * variance, 1e-9);
  EXPECT_NEAR(P(kImuIntrinsics + 10, kImuIntrinsics + 10), 1.5 * variance, 1e-9);
  EXPECT_NEAR(P(kImuIntrinsics + 10, kImuIntrinsics + 12), -0.5 * variance, 1e-9);
  EXPECT_NEAR(std::sqrt(P(kExtrinsics, kExtrinsics)), 0.001, 1e-9);
  EXPECT_NEAR(std::sqrt(P(kTimeOffset, kTimeOffset)), 0.005, 1e-9);
}

TEST(StartPrior, CoefficientsOfDistortionThatAreAllZeroWereNotMeasured) {
  WindowState start;
  start.frames.emplace_back();
  CameraModel measured;
  measured.distortion[1] = 0.02;
  const CalibrationSigmas exact{.distortion = 1e-5};
  const auto sigma = [&](const CameraModel& camera, const CalibrationSigmas& given) {
    const WindowPrior prior =
        StartPrior(start, Eigen::Matrix<double, 15, 15>::Identity(), camera, given, ImuNoise{});
    return 1 / std::sqrt(prior.H(kIntrinsics + 3, kIntrinsics + 3));
  };
  EXPECT_NEAR(sigma(CameraModel{}, {}), 0.1, 1e-6);
  EXPECT_NEAR(sigma(measured, {}), 0.0003, 1e-8);
  EXPECT_NEAR(sigma(CameraModel{}, exact), 1e-5, 1e-10);
}

}  // namespace
}  // namespace pangea::vio
