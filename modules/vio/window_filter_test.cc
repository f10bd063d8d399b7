#include "vio/window_filter.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <cmath>
#include <random>

#include "vio/point_geometry.h"
#include "vio/window_test_state.h"

namespace pangea::vio {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

const ImuNoise kNoNoise{0, 0, 0, 0, 200};

std::vector<ImuSample> Samples(int count, uint64_t seed) {
  std::mt19937_64 rng(seed);
  std::vector<ImuSample> samples;
  for (int i = 0; i < count; ++i) {
    samples.push_back({1'000'000 + 5'000 * i, Vector3d(0.3, -0.4, 0.8) + RandomVector(rng, 0.1),
                       Vector3d(0.5, 0.2, 9.9) + RandomVector(rng, 0.3)});
  }
  return samples;
}

MatrixXd RandomMatrix(int rows, int cols, std::mt19937_64& rng) {
  std::normal_distribution<double> normal;
  MatrixXd m(rows, cols);
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < cols; ++j) {
      m(i, j) = normal(rng);
    }
  }
  return m;
}

// The filter keeps its transition to itself. Phi P Phi^T shows all of it when P's cross-covariance
// with the clones is the identity.
MatrixXd TransitionOf(const WindowState& state, std::span<const ImuSample> samples) {
  WindowState probe = state;
  probe.covariance = MatrixXd::Zero(state.size(), state.size());
  probe.covariance.block<15, 15>(0, kFixedSize).setIdentity();
  probe.covariance.block<15, 15>(kFixedSize, 0).setIdentity();
  WindowFilter filter(kNoNoise, probe);
  filter.Propagate(samples);
  return filter.state().covariance.block<15, 15>(0, kFixedSize);
}

WindowState Propagated(const WindowState& state, std::span<const ImuSample> samples) {
  WindowFilter filter(kNoNoise, state);
  filter.Propagate(samples);
  return filter.state();
}

MatrixXd NumericTransition(const WindowState& state, std::span<const ImuSample> samples) {
  MatrixXd numeric(15, 15);
  const WindowState mean = Propagated(state, samples);
  constexpr double kStep = 1e-5;
  for (int k = 0; k < 15; ++k) {
    WindowState plus = state, minus = state;
    plus.Retract(kStep * VectorXd::Unit(state.size(), k));
    minus.Retract(-kStep * VectorXd::Unit(state.size(), k));
    const VectorXd d =
        Difference(Propagated(plus, samples), mean) - Difference(Propagated(minus, samples), mean);
    numeric.col(k) = d.head<15>() / (2 * kStep);
  }
  return numeric;
}

TEST(Difference, UndoesRetract) {
  std::mt19937_64 rng(1);
  const WindowState state = TestWindow(3, 2, 1);
  const VectorXd error = 0.1 * RandomMatrix(state.size(), 1, rng);
  WindowState moved = state;
  moved.Retract(error);
  EXPECT_LT((Difference(moved, state) - error).norm(), 1e-12);
}

TEST(Propagate, TransitionMatchesDifferences) {
  const WindowState state = TestWindow(3, 0, 2);
  const std::vector<ImuSample> samples = Samples(21, 3);  // 0.1 s
  const MatrixXd Phi = TransitionOf(state, samples);
  const MatrixXd numeric = NumericTransition(state, samples);
  // Midpoint steps: what is left is third order in 5 ms.
  EXPECT_LT((Phi - numeric).cwiseAbs().maxCoeff(), 1e-4) << Phi - numeric;
  // The invariant part is exact: nothing in it depends on where the state is.
  EXPECT_LT((Phi.leftCols(9) - numeric.leftCols(9)).cwiseAbs().maxCoeff(), 1e-7);
}

TEST(Propagate, TransitionOfPoseAndVelocityIsTheSameAnywhere) {
  const std::vector<ImuSample> samples = Samples(41, 3);
  const MatrixXd a = TransitionOf(TestWindow(3, 0, 2), samples);
  const MatrixXd b = TransitionOf(TestWindow(3, 0, 9), samples);
  EXPECT_LT((a.leftCols(9) - b.leftCols(9)).norm(), 1e-12);
}

TEST(Propagate, NoiseIsThatOfTheSamples) {
  // Monte Carlo over noisy samples of the same motion: the covariance that propagation adds is the
  // spread.
  const ImuNoise noise{2e-3, 1e-3, 2e-2, 1e-2, 200};
  WindowState state = TestWindow(1, 0, 4);
  state.covariance.setZero();
  const std::vector<ImuSample> clean = Samples(101, 5);
  WindowFilter filter(noise, state);
  filter.Propagate(clean);
  const MatrixXd P = filter.state().covariance.topLeftCorner<15, 15>();
  const WindowState mean = Propagated(state, clean);
  std::mt19937_64 rng(6);
  const double dt = 0.005;
  MatrixXd spread = MatrixXd::Zero(9, 9);
  constexpr int kTrials = 1000;
  for (int trial = 0; trial < kTrials; ++trial) {
    WindowState truth = state;
    for (size_t i = 0; i + 1 < clean.size(); ++i) {
      std::array<ImuSample, 2> pair = {clean[i], clean[i + 1]};
      // One draw per step, as the density says.
      const Vector3d gyro = RandomVector(rng, noise.gyro_noise_density / std::sqrt(dt));
      const Vector3d accel = RandomVector(rng, noise.accel_noise_density / std::sqrt(dt));
      for (ImuSample& sample : pair) {
        sample.gyro += gyro;
        sample.accel += accel;
      }
      truth = Propagated(truth, pair);
      truth.imu.gyro_bias += RandomVector(rng, noise.gyro_random_walk * std::sqrt(dt));
      truth.imu.accel_bias += RandomVector(rng, noise.accel_random_walk * std::sqrt(dt));
    }
    const VectorXd e = Difference(truth, mean).head<9>();
    spread += e * e.transpose() / kTrials;
  }
  const VectorXd ratio = spread.diagonal().cwiseQuotient(P.diagonal().head(9));
  EXPECT_GT(ratio.minCoeff(), 0.8) << ratio.transpose();
  EXPECT_LT(ratio.maxCoeff(), 1.2) << ratio.transpose();
}

TEST(AddClone, JacobianIncludesTheTimeOffset) {
  const WindowState state = TestWindow(2, 2, 7);
  const Vector3d omega(0.4, -0.2, 0.9);
  WindowState probe = state;
  WindowFilter filter(kNoNoise, probe);
  filter.AddClone(2'000'000, omega);
  const WindowState& grown = filter.state();
  ASSERT_EQ(grown.covariance.rows(), state.size() + kCloneSize);
  const int at = grown.CloneOffset(2);

  // The clone's pose is the IMU's, moved on by the error of the offset.
  const auto clone_of = [&](const WindowState& s) {
    const double dt = s.time_offset_s - state.time_offset_s;
    WindowState out = s;
    Clone clone;
    clone.T_odom_body = {s.imu.T_odom_body.q * ExpSo3(dt * omega),
                         s.imu.T_odom_body.t + dt * s.imu.v_odom_body};
    out.clones = {clone};
    out.landmarks.clear();
    return out;
  };
  MatrixXd J(kCloneSize, state.size());
  constexpr double kStep = 1e-5;
  for (int k = 0; k < state.size(); ++k) {
    WindowState plus = state, minus = state;
    plus.Retract(kStep * VectorXd::Unit(state.size(), k));
    minus.Retract(-kStep * VectorXd::Unit(state.size(), k));
    J.col(k) =
        (Difference(clone_of(plus), clone_of(state)) - Difference(clone_of(minus), clone_of(state)))
            .segment<6>(kFixedSize) /
        (2 * kStep);
  }
  EXPECT_GT(J.col(kTimeOffset).norm(), 0.5);
  const MatrixXd JP = J * state.covariance;
  EXPECT_LT((grown.covariance.block(at, at, 6, 6) - JP * J.transpose()).norm(), 1e-8);
  EXPECT_LT((grown.covariance.block(at, 0, 6, at) - JP.leftCols(at)).norm(), 1e-8);
  EXPECT_LT((grown.covariance.block(at, at + 6, 6, 6) - JP.rightCols(6)).norm(), 1e-8);
  EXPECT_LT((grown.covariance - grown.covariance.transpose()).norm(), 1e-15);
}

TEST(Update, IsTheLeastSquaresSolution) {
  for (const int rows : {5, 200}) {  // fewer than the state's size, and more: compressed
    std::mt19937_64 rng(8);
    const WindowState state = TestWindow(2, 2, 8);
    const double sigma = 0.05;
    const Measurement m{RandomMatrix(rows, state.size(), rng), 0.01 * RandomMatrix(rows, 1, rng)};
    WindowFilter filter(kNoNoise, state);
    filter.Update(m, sigma);

    const MatrixXd information =
        state.covariance.inverse() + m.H.transpose() * m.H / (sigma * sigma);
    const VectorXd x = information.ldlt().solve(m.H.transpose() * m.r / (sigma * sigma));
    EXPECT_LT((Difference(filter.state(), state) - x).norm(), 1e-8 * (1 + x.norm()));
    const MatrixXd& P = filter.state().covariance;
    EXPECT_LT((P - information.inverse()).norm(), 1e-8 * state.covariance.norm());
    EXPECT_EQ((P - P.transpose()).norm(), 0);
    // It shrinks: the difference is positive semidefinite, and P stays positive definite.
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<MatrixXd>(state.covariance - P).eigenvalues()[0],
              -1e-12);
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<MatrixXd>(P).eigenvalues()[0], 0);
  }
}

TEST(Nis, IsTheNormalisedInnovation) {
  std::mt19937_64 rng(9);
  const WindowState state = TestWindow(2, 0, 9);
  const Measurement m{RandomMatrix(4, state.size(), rng), RandomMatrix(4, 1, rng)};
  const WindowFilter filter(kNoNoise, state);
  const MatrixXd S = m.H * state.covariance * m.H.transpose() + 0.04 * MatrixXd::Identity(4, 4);
  EXPECT_NEAR(filter.Nis(m, 0.2), m.r.dot(S.inverse() * m.r), 1e-9);
}

TEST(Remove, KeepsTheRest) {
  const WindowState state = TestWindow(3, 3, 10);
  WindowFilter filter(kNoNoise, state);
  filter.RemoveClone(1);
  filter.RemoveLandmark(2);
  const WindowState& left = filter.state();
  std::vector<int> kept;
  for (int i = 0; i < state.size(); ++i) {
    const bool clone = i >= state.CloneOffset(1) && i < state.CloneOffset(2);
    if (!clone && i < state.LandmarkOffset(2)) {
      kept.push_back(i);
    }
  }
  ASSERT_EQ(left.size(), static_cast<int>(kept.size()));
  EXPECT_EQ((left.covariance - MatrixXd(state.covariance(kept, kept))).norm(), 0);
  EXPECT_EQ(left.clones[1].utime, state.clones[2].utime);
  EXPECT_EQ(left.landmarks[1].first, state.landmarks[1].first);
}

TEST(ReplaceLandmark, ChangesItsOwnRowsOnly) {
  const WindowState state = TestWindow(3, 2, 11);
  WindowFilter filter(kNoNoise, state);
  const auto moved = Reanchor(state, 0, 2);
  ASSERT_TRUE(moved);
  filter.ReplaceLandmark(0, moved->point, moved->J);
  MatrixXd A = MatrixXd::Identity(state.size(), state.size());
  A.middleRows(state.LandmarkOffset(0), 3) = moved->J;
  EXPECT_LT((filter.state().covariance - A * state.covariance * A.transpose()).norm(), 1e-12);
  EXPECT_EQ(filter.state().landmarks[0].second.anchor_utime, state.clones[2].utime);
}

// Rays of a point that is off from where the window's poses put it.
std::vector<ClonedRay> NoisyRays(const WindowState& state, const AnchoredPoint& point, double sigma,
                                 std::mt19937_64& rng) {
  std::vector<ClonedRay> rays;
  for (int i = 0; i < static_cast<int>(state.clones.size()); ++i) {
    rays.push_back(
        {i, PredictRay(state, point, i, false)->ray + RandomVector(rng, sigma).head<2>(), sigma});
  }
  return rays;
}

TEST(AddLandmark, EqualsAnUpdateWithAnUnknownPoint) {
  std::mt19937_64 rng(12);
  const WindowState full = TestWindow(4, 1, 12);
  const AnchoredPoint point = full.landmarks[0].second;
  WindowState state = full;
  state.landmarks.clear();
  state.covariance = MatrixXd(full.covariance.topLeftCorner(state.size(), state.size()));
  const auto m = MeasurePoint(state, point, NoisyRays(state, point, 2e-3, rng));
  ASSERT_TRUE(m);
  WindowFilter filter(kNoNoise, state);
  filter.AddLandmark(7, point, m->x, m->H_f, 1.0);

  // The same in information form: no prior on the point.
  const int n = state.size();
  MatrixXd H(m->x.H.rows(), n + 3);
  H << m->x.H, m->H_f;
  MatrixXd information = H.transpose() * H;
  information.topLeftCorner(n, n) += state.covariance.inverse();
  const MatrixXd expected = information.inverse();
  const MatrixXd& P = filter.state().covariance;
  EXPECT_LT((P - expected).norm(), 1e-7 * expected.norm());
  const VectorXd x = expected * H.transpose() * m->x.r;
  WindowState before = state;
  before.landmarks.emplace_back(7, point);
  EXPECT_LT((Difference(filter.state(), before) - x).norm(), 1e-6 * x.norm());
}

TEST(Unobservable, NoMeasurementSeesGlobalPositionAndYawWhereverItIsLinearised) {
  for (uint64_t seed = 1; seed <= 10; ++seed) {
    const WindowState state = TestWindow(4, 3, seed);
    const MatrixXd N = UnobservableDirections(state);
    std::mt19937_64 rng(seed);
    for (int landmark = 0; landmark < 3; ++landmark) {
      const AnchoredPoint& point = state.landmarks[landmark].second;
      for (int clone = 0; clone < 4; ++clone) {
        EXPECT_LT((PredictRay(state, point, clone, true)->H_x * N).norm(), 1e-12);
        EXPECT_LT((Reanchor(state, landmark, clone)->J * N).norm(), 1e-12);
      }
      const auto track = MeasurePoint(state, point, NoisyRays(state, point, 1e-3, rng));
      const Measurement m = WithoutPoint(*track);
      EXPECT_LT((m.H * N).norm(), 1e-9 * m.H.norm());
    }
    // They stay what they are while the IMU moves.
    const MatrixXd Phi = TransitionOf(state, Samples(21, seed));
    EXPECT_LT((Phi * N.topRows(15) - N.topRows(15)).norm(), 1e-12);
  }
}

TEST(Unobservable, ManyUpdatesAddNoInformationAboutThem) {
  WindowState state = TestWindow(5, 4, 20);
  WindowFilter filter(ImuNoise{}, state);
  const MatrixXd N = UnobservableDirections(state);
  const MatrixXd before = N.transpose() * state.covariance.ldlt().solve(N);
  std::mt19937_64 rng(21);
  for (int round = 0; round < 100; ++round) {
    const WindowState& now = filter.state();
    for (int i = 0; i < 4; ++i) {
      const auto predicted = PredictRay(now, now.landmarks[i].second, round % 5, true);
      ASSERT_TRUE(predicted);
      Measurement m{predicted->H_x, RandomVector(rng, 1e-3).head<2>()};
      m.H.middleCols(now.LandmarkOffset(i), 3) = predicted->H_f;
      filter.Update(m, 5e-3);  // the point of linearisation moves each time
    }
  }
  const MatrixXd after = N.transpose() * filter.state().covariance.ldlt().solve(N);
  EXPECT_LT((after - before).norm(), 1e-6 * before.norm());
  // Other directions did gain: the test has teeth.
  EXPECT_LT(filter.state().covariance.trace(), 0.9 * state.covariance.trace());
}

}  // namespace
}  // namespace pangea::vio
