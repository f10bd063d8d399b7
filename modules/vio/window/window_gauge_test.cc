// Tests that a prior has no information on position and yaw after many linearisations.

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <iostream>
#include <map>

#include "vio/window/testing/vio_test_world.h"
#include "vio/window/testing/window_test_world.h"
#include "vio/window/window_problem.h"

namespace pangea::vio {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kMarginalisations = 40;
constexpr int kViews = 8;                 // largest number of images with a landmark
constexpr double kSpread = 0.01;          // of every error of the window, at each linearisation
constexpr double kGaugeRaySigma = 0.002;  // 0.8 px

// A ride as one long window at its true state, with inertial samples between its images and noisy
// rays. Its prior has only information on the IMU's axes: rotated together with body and camera,
// they would be those of another body.
WindowProblem RideWindow(uint64_t seed) {
  VioTestWorldOptions options;
  options.seed = seed;
  options.outlier_share = 0;
  VioTestWorld world(options);
  WindowProblem problem;
  problem.state.T_body_cam = world.camera().T_body_cam;
  std::map<int32_t, Landmark> open;  // landmarks that can still be seen again
  ImuSample last_sample;
  for (int i = 0; i < kMarginalisations + kViews; ++i) {
    VioTestWorld::Input input = world.Next();
    WindowFrame frame;
    frame.utime = frame.imu_utime = input.frame.utime;
    frame.imu = world.TruthAt(frame.utime);
    frame.omega_body = input.imu.back().gyro - frame.imu.gyro_bias;
    std::optional<ImuFactor> factor;
    if (i > 0) {
      const ImuState& from = problem.state.frames.back().imu;
      input.imu.insert(input.imu.begin(), last_sample);
      factor.emplace();
      factor->span = IntegrateScaled(input.imu, ImuNoise{}, {}, from.gyro_bias, from.accel_bias);
      factor->information = InertialInformation(factor->span.measured, ImuNoise{});
    }
    last_sample = input.imu.back();
    problem.state.frames.push_back(frame);
    problem.imu_factors.push_back(factor);
    for (const Observation& seen : input.frame.observations) {
      Landmark& landmark = open[seen.landmark_id];
      if (landmark.rays.size() == kViews) {
        problem.landmarks.push_back(landmark);
        landmark = {};
      }
      if (landmark.rays.empty()) {
        const double depth = *world.TrueDepth(seen.landmark_id, frame.utime);
        landmark = {seen.landmark_id, {i, 0, {seen.ray.x(), seen.ray.y(), 1 / depth}}, {}};
      }
      landmark.rays.push_back({i, seen.ray, kGaugeRaySigma, 0});
    }
  }
  for (const auto& [id, landmark] : open) {
    if (landmark.rays.size() > 2) {
      problem.landmarks.push_back(landmark);
    }
  }
  problem.prior.at = problem.state;
  problem.prior.H.setZero(problem.state.size(), problem.state.size());
  problem.prior.g.setZero(problem.state.size());
  problem.prior.H.diagonal().segment<kImuIntrinsicsSize>(kImuIntrinsics).setConstant(1e4);
  return problem;
}

// Most odometries keep a prior in plain errors (dtheta, dp, dv). Returns the information of such a
// prior in the window's coordinates at a new state. With xi = d + value x dtheta, the same plain
// error there is xi_then = xi_now + (value_then - value_now) x dtheta.
MatrixXd KeptInPlainErrors(const WindowPrior& prior, const WindowState& now) {
  MatrixXd H = prior.H;
  for (int side = 0; side < 2; ++side) {
    for (int i = 0; i <= now.Newest(); ++i) {
      const ImuState &then_i = prior.at.frames[i].imu, &now_i = now.frames[i].imu;
      const int at = now.FirstRow(i);
      H.middleCols<3>(at + kTheta) +=
          H.middleCols<3>(at + kPosition) * Hat(then_i.T_odom_body.t - now_i.T_odom_body.t) +
          H.middleCols<3>(at + kVelocity) * Hat(then_i.v_odom_body - now_i.v_odom_body);
    }
    H.transposeInPlace();
  }
  return H;
}

// The prior after all marginalisations, for each of which all frames are linearised anew around the
// truth.
WindowPrior Marginalised(WindowProblem problem, bool plain_errors) {
  WindowState truth = problem.state;
  for (int round = 0; round < kMarginalisations; ++round) {
    problem.state = truth;
    problem.state.Retract(RandomError(truth, kSpread, 100 + round));
    if (plain_errors) {
      problem.prior.H = KeptInPlainErrors(problem.prior, problem.state);
      problem.prior.at = problem.state;
    }
    MarginaliseOldest(problem, {});
    truth.frames.erase(truth.frames.begin());
  }
  return problem.prior;
}

// Eigenvalues of the information, with rows scaled to a unit diagonal: the largest for a shift or a
// rotation about the vertical, and the smallest for the directions perpendicular to these.
struct Knowledge {
  double of_gauge = 0;
  double of_the_rest = 0;
};
Knowledge Known(const WindowPrior& prior) {
  std::vector<int> rows;  // rows on which the prior has information
  for (int i = 0; i < prior.H.rows(); ++i) {
    if (prior.H(i, i) > 0) {
      rows.push_back(i);
    }
  }
  const MatrixXd H = prior.H(rows, rows);
  const VectorXd scale = H.diagonal().cwiseSqrt();
  const MatrixXd S = scale.cwiseInverse().asDiagonal() * H * scale.cwiseInverse().asDiagonal();
  const MatrixXd N_all = UnobservableDirections(prior.at);
  const MatrixXd N = scale.asDiagonal() * MatrixXd(N_all(rows, Eigen::all));
  const MatrixXd Q = Eigen::HouseholderQR<MatrixXd>(N).householderQ();
  const MatrixXd gauge = Q.leftCols(4), rest = Q.rightCols(Q.cols() - 4);
  const Eigen::SelfAdjointEigenSolver<MatrixXd> of_gauge(gauge.transpose() * S * gauge);
  const Eigen::SelfAdjointEigenSolver<MatrixXd> of_the_rest(rest.transpose() * S * rest);
  return {of_gauge.eigenvalues().cwiseAbs().maxCoeff(), of_the_rest.eigenvalues().minCoeff()};
}

TEST(WindowGauge, FortyMarginalisationsLearnNothingOfPositionAndYaw) {
  for (uint64_t seed = 1; seed <= 3; ++seed) {
    const WindowProblem ride = RideWindow(seed);
    const Knowledge invariant = Known(Marginalised(ride, false));
    const Knowledge plain = Known(Marginalised(ride, true));
    std::cout << "ride " << seed << ": position and yaw " << invariant.of_gauge
              << ", the least known of the rest " << invariant.of_the_rest << "; with plain errors "
              << plain.of_gauge << ", " << plain.of_the_rest << "\n";
    EXPECT_LT(invariant.of_gauge, 1e-5 * invariant.of_the_rest) << "seed " << seed;
    // Errors that are not invariant gain information on the same ride, so this measure detects it.
    EXPECT_GT(plain.of_gauge, 0.1 * invariant.of_the_rest) << "seed " << seed;
  }
}

}  // namespace
}  // namespace pangea::vio
