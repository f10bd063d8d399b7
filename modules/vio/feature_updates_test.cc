// The filter with its feature updates, started from a known uncertainty: is it as certain as it
// may be? NEES = error' P^-1 error, the dimension on average when it is (Bar-Shalom et al., 2001).

#include "vio/feature_updates.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <deque>

#include "common/preintegration.h"
#include "vio/vio_test_world.h"
#include "vio/window_test_state.h"

namespace pangea::vio {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr int kWindow = 11;
constexpr double kRotationSigma = 0.005, kTranslationSigma = 0.005, kOffsetSigma = 0.003;

ImuState TruthAtImuTime(const VioTestWorld& world, int64_t utime) {
  return world.TruthAt(utime - std::llround(1e6 * world.true_time_offset_s()));
}

// Position and yaw are known at the start: what follows is measured against it.
WindowState DrawStart(const VioTestWorld& world, int64_t utime, std::mt19937_64& rng) {
  WindowState state;
  state.T_body_cam = world.true_T_body_cam();
  state.time_offset_s = world.true_time_offset_s();
  VectorXd sigma(kFixedSize);
  sigma << 0.01, 0.01, 1e-6, Vector3d::Constant(1e-6), Vector3d::Constant(0.05),
      Vector3d::Constant(0.002), Vector3d::Constant(0.05), Vector3d::Constant(kRotationSigma),
      Vector3d::Constant(kTranslationSigma), kOffsetSigma;
  state.covariance = sigma.cwiseAbs2().asDiagonal();
  std::normal_distribution<double> normal;
  VectorXd error(kFixedSize);
  for (int i = 0; i < kFixedSize; ++i) {
    error[i] = sigma[i] * normal(rng);
  }
  // The state's IMU is at the time the filter takes the image to be of.
  state.imu =
      TruthAtImuTime(world, utime + std::llround(1e6 * (state.time_offset_s + error[kTimeOffset])));
  state.Retract(error);
  return state;
}

// The estimator's loop, bare.
class Loop {
 public:
  Loop(const VioTestWorldOptions& options, double pixel_sigma, uint64_t seed)
      : world_(options), rng_(seed), updates_(kWindow, 50) {
    ray_sigma_ = pixel_sigma * world_.camera().PixelAngle();
    const VioTestWorld::Input input = world_.Next();
    samples_.assign(input.imu.end() - 1, input.imu.end());
    utime_ = input.frame.utime;
    filter_.emplace(ImuNoise{}, DrawStart(world_, utime_, rng_));
    imu_utime_ = ImuTime(utime_);
    samples_.insert(samples_.begin(), input.imu.end() - 10, input.imu.end() - 1);
  }

  void Step() {
    const VioTestWorld::Input input = world_.Next();
    samples_.insert(samples_.end(), input.imu.begin(), input.imu.end());
    utime_ = input.frame.utime;
    Propagate(ImuTime(utime_));
    filter_->AddClone(utime_, omega_);
    history_.AddFrame(input.frame, ray_sigma_);
    world_.Drop(updates_.Apply(*filter_, history_).outliers);
    if (filter_->state().clones.size() > kWindow) {
      updates_.MoveAnchors(*filter_, 0);
      history_.RemoveFrame(filter_->state().clones[0].utime);
      filter_->RemoveClone(0);
    }
    updates_.Forget(history_, filter_->state());
  }

  // Position, tilt, velocity, gyro bias, accelerometer bias, all fifteen.
  Eigen::Matrix<double, 6, 1> Nees() const {
    const WindowState& state = filter_->state();
    const ImuState truth = TruthAtImuTime(world_, imu_utime_);
    WindowState true_state = state;
    true_state.imu = truth;
    VectorXd e = Difference(true_state, state).head<15>();
    MatrixXd P = state.covariance.topLeftCorner<15, 15>();
    const auto nees = [](const VectorXd& x, const MatrixXd& C) { return x.dot(C.llt().solve(x)); };
    Eigen::Matrix<double, 6, 1> out;
    out[5] = nees(e, P);
    // To plain differences of position and velocity.
    MatrixXd J = MatrixXd::Identity(15, 15);
    J.block<3, 3>(kPosition, kTheta) = -Hat(truth.T_odom_body.t);
    J.block<3, 3>(kVelocity, kTheta) = -Hat(truth.v_odom_body);
    e = (J * e).eval();
    P = (J * P * J.transpose()).eval();
    const auto block = [&](int at, int n) { return nees(e.segment(at, n), P.block(at, at, n, n)); };
    out.head<5>() << block(kPosition, 3), block(kTheta, 2), block(kVelocity, 3),
        block(kGyroBias, 3), block(kAccelBias, 3);
    return out;
  }
  double PositionError() const {
    return (filter_->state().imu.T_odom_body.t - TruthAtImuTime(world_, imu_utime_).T_odom_body.t)
        .norm();
  }
  const WindowState& state() const { return filter_->state(); }

 private:
  // The offset's error is in the state; its estimate moves the end of propagation.
  int64_t ImuTime(int64_t utime) const {
    return utime + std::llround(1e6 * filter_->state().time_offset_s);
  }
  void Propagate(int64_t target) {
    std::vector<ImuSample> span;
    for (size_t i = 0; i + 1 < samples_.size(); ++i) {
      const ImuSample &a = samples_[i], &b = samples_[i + 1];
      if (b.utime <= imu_utime_ || a.utime >= target) {
        continue;
      }
      if (span.empty()) {
        span.push_back(a.utime < imu_utime_ ? InterpolateImu(a, b, imu_utime_) : a);
      }
      span.push_back(b.utime > target ? InterpolateImu(a, b, target) : b);
    }
    if (span.back().utime < target) {
      span.push_back(span.back());
      span.back().utime = target;
    }
    filter_->Propagate(span);
    imu_utime_ = target;
    omega_ = span.back().gyro - filter_->state().imu.gyro_bias;
    while (samples_.size() > 100) {
      samples_.pop_front();
    }
  }

  VioTestWorld world_;
  std::mt19937_64 rng_;
  FeatureUpdates updates_;
  TrackHistory history_;
  std::optional<WindowFilter> filter_;
  std::deque<ImuSample> samples_;
  double ray_sigma_ = 0;
  int64_t utime_ = 0, imu_utime_ = 0;
  Vector3d omega_ = Vector3d::Zero();
};

TEST(ChiSquare95, MatchesTheTable) {
  EXPECT_NEAR(ChiSquare95(2), 5.991, 0.1);
  EXPECT_NEAR(ChiSquare95(10), 18.307, 0.05);
  EXPECT_NEAR(ChiSquare95(100), 124.342, 0.05);
}

TEST(FeatureUpdates, FilterIsConsistent) {
  constexpr int kSeeds = 10;
  constexpr int kFrames = 80;  // 8 s
  Eigen::Matrix<double, 6, 1> dimension, mean = Eigen::Matrix<double, 6, 1>::Zero();
  dimension << 3, 2, 3, 3, 3, 15;
  int count = 0;
  double error = 0;
  for (uint64_t seed = 1; seed <= kSeeds; ++seed) {
    VioTestWorldOptions options;
    options.seed = seed;
    Loop loop(options, options.pixel_noise, 100 + seed);
    for (int i = 0; i < kFrames; ++i) {
      loop.Step();
      if (i >= 20 && i % 5 == 0) {
        mean += loop.Nees();
        ++count;
      }
    }
    error += loop.PositionError() / kSeeds;
  }
  mean /= count;
  const Eigen::Matrix<double, 6, 1> ratio = mean.cwiseQuotient(dimension);
  std::cout << "NEES/dimension (position, tilt, velocity, gyro bias, accel bias, all): "
            << ratio.transpose() << "; position error after 8 s: " << error << " m\n";
  EXPECT_GT(ratio.minCoeff(), 0.3);
  EXPECT_LT(ratio.maxCoeff(), 3.0);
  EXPECT_LT(error, 0.15);
}

}  // namespace
}  // namespace pangea::vio
