#include "core/imu/imu_factor.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "core/testing/test_random.h"
#include "vio/window/testing/window_test_world.h"

namespace pangea::vio {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

WindowProblem TwoFrames(uint64_t seed) {
  WindowTestOptions options;
  options.seed = seed;
  options.frames = 2;
  options.landmarks = 0;
  return TestWindow(options);
}

InertialResidual ResidualOf(const WindowProblem& problem, const WindowState& state) {
  return ComputeInertialResidual(At(problem.imu_factors[1]->span, state.imu_intrinsics),
                                 state.frames[0].imu, state.frames[1].imu);
}

TEST(ImuFactorTest, IsZeroForAnExactMotion) {
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    const WindowProblem problem = TwoFrames(seed);
    EXPECT_LT(ResidualOf(problem, problem.state).r.norm(), 1e-12);
  }
}

// Compares with the equations of motion: in free fall the accelerometer measures zero.
TEST(ImuFactorTest, PredictsAFall) {
  ImuState from;
  from.v_odom_body = {1, 2, 3};
  const std::vector<ImuSample> samples = {{0, Vector3d::Zero(), Vector3d::Zero()},
                                          {500'000, Vector3d::Zero(), Vector3d::Zero()}};
  const ImuState to =
      Predict(Integrate(samples, ImuNoise{}, Vector3d::Zero(), Vector3d::Zero()), from);
  EXPECT_LT((to.v_odom_body - Vector3d(1, 2, 3 - 0.5 * kGravity)).norm(), 1e-12);
  EXPECT_LT((to.T_odom_body.t - Vector3d(0.5, 1, 1.5 - 0.125 * kGravity)).norm(), 1e-12);
}

// At states that differ from each other's prediction and from the bias of the linearisation.
TEST(ImuFactorTest, DerivativesMatchDifferencesInEveryColumn) {
  for (uint64_t seed = 1; seed <= 10; ++seed) {
    const WindowProblem problem = TwoFrames(seed);
    WindowState state = problem.state;
    state.Retract(RandomError(state, 0.1, seed));
    const InertialResidual residual = ResidualOf(problem, state);
    ASSERT_GT(residual.r.norm(), 0.05);
    MatrixXd J = MatrixXd::Zero(15, state.size());
    J.middleCols<15>(state.FirstRow(0)) = residual.J_from;
    J.middleCols<15>(state.FirstRow(1)) = residual.J_to;
    J.middleCols<kImuIntrinsicsSize>(kImuIntrinsics) =
        ImuIntrinsicsJacobian(problem.imu_factors[1]->span, state.imu_intrinsics,
                              state.frames[0].imu.gyro_bias, residual.r.head<3>());
    const MatrixXd numeric = NumericJacobian(
        state, [&](const WindowState& s) -> VectorXd { return ResidualOf(problem, s).r; });
    EXPECT_LT((J - numeric).cwiseAbs().maxCoeff(), 1e-7) << "seed " << seed;
  }
}

TEST(ImuFactorTest, ShiftsAndRotationsTogetherAreFree) {
  const WindowProblem problem = TwoFrames(3);
  WindowState state = problem.state;
  state.Retract(RandomError(state, 0.1, 3));
  const InertialResidual residual = ResidualOf(problem, state);
  MatrixXd J = MatrixXd::Zero(15, state.size());
  J.middleCols<15>(state.FirstRow(0)) = residual.J_from;
  J.middleCols<15>(state.FirstRow(1)) = residual.J_to;
  EXPECT_LT((J * UnobservableDirections(state)).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(ImuFactorTest, InformationIsTheInverseOfTheCovariance) {
  ImuNoise noise;  // large, so that the minimum covariances of the integration have no effect
  noise.gyro_noise_density *= 1000;
  noise.accel_noise_density *= 1000;
  const auto samples = TestSamples(41, 0, 1);
  const Preintegration measured = Integrate(samples, noise, Vector3d::Zero(), Vector3d::Zero());
  const auto information = InertialInformation(measured, noise);
  const Eigen::Matrix<double, 9, 9> product =
      information.topLeftCorner<9, 9>() * measured.covariance;
  const Eigen::Matrix<double, 9, 9> scaled =  // because the entries have different units
      measured.covariance.diagonal().cwiseSqrt().asDiagonal() * product *
      measured.covariance.diagonal().cwiseSqrt().cwiseInverse().asDiagonal();
  EXPECT_LT((scaled - Eigen::Matrix<double, 9, 9>::Identity()).cwiseAbs().maxCoeff(), 1e-3);
  const double dt = measured.duration_s;
  EXPECT_NEAR(information(9, 9) * noise.gyro_random_walk * noise.gyro_random_walk * dt, 1, 1e-12);
  EXPECT_NEAR(information(12, 12) * noise.accel_random_walk * noise.accel_random_walk * dt, 1,
              1e-12);
}

// Samples with noise and random-walk biases: the residual at the true motion fits the information.
TEST(ImuFactorTest, InformationIsHonest) {
  const ImuNoise noise;
  constexpr int kTrials = 400;
  constexpr double kStep_s = 0.005;
  double nees = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    std::mt19937_64 rng(trial);
    const auto clean = TestSamples(101, 0, 1000 + trial);
    auto noisy = clean;
    ImuState from;
    const ImuState moved =
        Predict(Integrate(clean, noise, Vector3d::Zero(), Vector3d::Zero()), from);
    ImuState to = moved;
    for (ImuSample& sample : noisy) {
      sample.gyro +=
          to.gyro_bias + RandomVector(rng, noise.gyro_noise_density / std::sqrt(kStep_s));
      sample.accel +=
          to.accel_bias + RandomVector(rng, noise.accel_noise_density / std::sqrt(kStep_s));
      to.gyro_bias += RandomVector(rng, noise.gyro_random_walk * std::sqrt(kStep_s));
      to.accel_bias += RandomVector(rng, noise.accel_random_walk * std::sqrt(kStep_s));
    }
    const Preintegration measured = Integrate(noisy, noise, from.gyro_bias, from.accel_bias);
    const auto r = ComputeInertialResidual(measured, from, to).r;
    nees += r.dot(InertialInformation(measured, noise) * r) / kTrials;
  }
  // mean of 400 chi-square(15): 15 +- 0.27; the minimum covariances reduce it slightly
  EXPECT_NEAR(nees, 15, 1.5);
}

}  // namespace
}  // namespace pangea::vio
