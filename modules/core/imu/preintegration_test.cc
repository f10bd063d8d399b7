#include "core/imu/preintegration.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <random>

#include "core/rigid3.h"
#include "core/testing/numeric_jacobian.h"

namespace pangea {
namespace {

// Smooth angular rate and force at time t, seconds.
ImuSample SampleAt(double t) {
  ImuSample sample;
  sample.utime = static_cast<int64_t>(std::llround(t * 1e6));
  sample.gyro = {0.8 * std::sin(2 * t), 0.5 * std::cos(3 * t), 0.3 + 0.2 * std::sin(t)};
  sample.accel = {1.0 + std::sin(4 * t), 2 * std::cos(2 * t), 9.8 + 0.5 * std::sin(5 * t)};
  return sample;
}

Preintegration Integrate(double rate_hz, const Eigen::Vector3d& gyro_bias,
                         const Eigen::Vector3d& accel_bias) {
  Preintegrator integrator(ImuNoise{}, gyro_bias, accel_bias);
  const int steps = static_cast<int>(0.5 * rate_hz);
  for (int i = 0; i < steps; ++i) {
    integrator.Add(SampleAt(i / rate_hz), SampleAt((i + 1) / rate_hz));
  }
  return integrator.result();
}

Eigen::Matrix<double, 9, 1> Difference(const Preintegration& a, const Preintegration& b) {
  Eigen::Matrix<double, 9, 1> d;
  d << LogSo3(b.delta_q.conjugate() * a.delta_q), a.delta_v - b.delta_v, a.delta_p - b.delta_p;
  return d;
}

TEST(Preintegration, ConvergesWithTheRate) {
  const Eigen::Vector3d zero = Eigen::Vector3d::Zero();
  const Preintegration fine = Integrate(20000, zero, zero);
  const double coarse_error = Difference(Integrate(200, zero, zero), fine).norm();
  EXPECT_LT(coarse_error, 2e-4);
}

TEST(Preintegration, BiasJacobianMatchesDifferences) {
  const Eigen::Vector3d zero = Eigen::Vector3d::Zero();
  const Preintegration base = Integrate(200, zero, zero);
  const Eigen::MatrixXd numeric = NumericJacobian(6, 1e-5, [&](const Eigen::VectorXd& biases) {
    return Difference(Integrate(200, biases.head<3>(), biases.tail<3>()), base);
  });
  for (int k = 0; k < 6; ++k) {
    EXPECT_LT((numeric - base.bias_jacobian).col(k).norm(), 1e-4 * (1 + numeric.col(k).norm()))
        << k;
  }
}

TEST(Preintegration, TwoSpansComposeToOne) {
  const Eigen::Vector3d gyro_bias(0.01, -0.02, 0.015), accel_bias(0.1, 0.05, -0.1);
  Preintegrator whole(ImuNoise{}, gyro_bias, accel_bias), first = whole, second = whole;
  for (int i = 0; i < 150; ++i) {
    const ImuSample a = SampleAt(0.005 * i), b = SampleAt(0.005 * (i + 1));
    whole.Add(a, b);
    (i < 60 ? first : second).Add(a, b);
  }
  const Preintegration both = Compose(first.result(), second.result());
  EXPECT_NEAR(both.duration_s, whole.result().duration_s, 1e-12);
  EXPECT_LT(Difference(both, whole.result()).norm(), 1e-9);
  EXPECT_LT((both.covariance - whole.result().covariance).norm(),
            1e-9 * whole.result().covariance.norm());
  EXPECT_LT((both.bias_jacobian - whole.result().bias_jacobian).norm(), 1e-9);
}

// The second span was integrated with other biases; to first order the result is the same.
TEST(Preintegration, ComposesSpansOfDifferentBiases) {
  const Eigen::Vector3d bias(1e-3, -1e-3, 2e-3), zero = Eigen::Vector3d::Zero();
  const Preintegration a = Integrate(200, zero, zero);
  const Preintegration same = Compose(a, Integrate(200, zero, zero));
  const Preintegration other = Compose(a, Integrate(200, bias, 10 * bias));
  EXPECT_EQ(other.gyro_bias, zero);
  EXPECT_LT(Difference(same, other).norm(), 2e-6);
}

TEST(Preintegration, FirstOrderCorrectionFollowsTheBias) {
  const Eigen::Vector3d bg(0.01, -0.02, 0.015), ba(0.1, 0.05, -0.1);
  const Eigen::Vector3d zero = Eigen::Vector3d::Zero();
  const CorrectedDelta corrected = CorrectForBias(Integrate(200, zero, zero), bg, ba);
  const Preintegration exact = Integrate(200, bg, ba);
  EXPECT_LT((corrected.v - exact.delta_v).norm(), 2e-3);
  EXPECT_LT((corrected.p - exact.delta_p).norm(), 1e-3);
  EXPECT_LT(LogSo3(corrected.q.conjugate() * exact.delta_q).norm(), 1e-4);
}

// Monte Carlo: the normalised error squared of noisy integrations has mean 9.
TEST(Preintegration, CovarianceIsHonest) {
  std::mt19937_64 rng(5);
  std::normal_distribution<double> normal;
  const ImuNoise noise;
  const double rate = 200, sqrt_rate = std::sqrt(rate);
  const Eigen::Vector3d zero = Eigen::Vector3d::Zero();
  const Preintegration truth = Integrate(rate, zero, zero);
  constexpr int kRuns = 300;
  double sum = 0;
  for (int run = 0; run < kRuns; ++run) {
    Preintegrator integrator(noise, zero, zero);
    for (int i = 0; i < 100; ++i) {
      ImuSample a = SampleAt(i / rate), b = SampleAt((i + 1) / rate);
      // One draw per interval: what the mean of the interval's force carries.
      const Eigen::Vector3d ng = noise.gyro_noise_density * sqrt_rate *
                                 Eigen::Vector3d(normal(rng), normal(rng), normal(rng));
      const Eigen::Vector3d na = noise.accel_noise_density * sqrt_rate *
                                 Eigen::Vector3d(normal(rng), normal(rng), normal(rng));
      a.gyro += ng;
      b.gyro += ng;
      a.accel += na;
      b.accel += na;
      integrator.Add(a, b);
    }
    const Eigen::Matrix<double, 9, 1> error = Difference(integrator.result(), truth);
    sum += error.dot(integrator.result().covariance.llt().solve(error));
  }
  EXPECT_NEAR(sum / kRuns, 9.0, 1.0);  // standard error 0.25
}

std::vector<int64_t> Times(const std::vector<ImuSample>& samples) {
  std::vector<int64_t> times;
  for (const ImuSample& sample : samples) {
    times.push_back(sample.utime);
    EXPECT_NEAR(sample.gyro.x(), 1e-3 * static_cast<double>(sample.utime), 1e-12);
  }
  return times;
}

TEST(SamplesBetween, EndsAreInterpolatedAndTheLastSampleHolds) {
  std::vector<ImuSample> samples;
  for (int64_t utime = 1000; utime <= 5000; utime += 1000) {
    samples.push_back({utime, {1e-3 * static_cast<double>(utime), 0, 0}, Eigen::Vector3d::Zero()});
  }
  using Expected = std::vector<int64_t>;
  EXPECT_EQ(Times(SamplesBetween(samples, 2000, 4000)), (Expected{2000, 3000, 4000}));
  EXPECT_EQ(Times(SamplesBetween(samples, 2300, 4100)), (Expected{2300, 3000, 4000, 4100}));
  EXPECT_EQ(Times(SamplesBetween(samples, 2300, 2400)), (Expected{2300, 2400}));
  EXPECT_EQ(Times(SamplesBetween(samples, 0, 1500)), (Expected{1000, 1500}));
  const std::vector<ImuSample> held = SamplesBetween(samples, 4500, 5200);
  ASSERT_EQ(held.size(), 3u);
  EXPECT_EQ(held[2].utime, 5200);
  EXPECT_EQ(held[2].gyro, samples[4].gyro);
  EXPECT_TRUE(SamplesBetween(samples, 0, 900).empty());
  EXPECT_TRUE(SamplesBetween(samples, 6000, 7000).empty());
  EXPECT_TRUE(SamplesBetween({}, 0, 1000).empty());
}

}  // namespace
}  // namespace pangea
