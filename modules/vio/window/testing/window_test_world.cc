#include "vio/window/testing/window_test_world.h"

#include "core/testing/numeric_jacobian.h"
#include "core/testing/test_cameras.h"
#include "core/testing/test_random.h"

namespace pangea::vio {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr int kSamplesPerImuFactor = 40;
constexpr int64_t kSampleStep_us = 5'000;
constexpr double kRaySigma = 2e-3;

WindowFrame FirstFrame(double time_offset_s, std::mt19937_64& rng) {
  WindowFrame frame;
  frame.time_offset_s = time_offset_s;
  // Far from zero, where wrong position columns have an effect.
  frame.imu.T_odom_body = {ExpSo3(RandomVector(rng, 0.1)),
                           Vector3d(3, -2, 1) + RandomVector(rng, 0.5)};
  frame.imu.v_odom_body = RandomVector(rng, 1);
  frame.imu.gyro_bias = RandomVector(rng, 0.02);
  frame.imu.accel_bias = RandomVector(rng, 0.1);
  return frame;
}

Eigen::Matrix<double, kImuIntrinsicsSize, 1> RandomImuIntrinsics(double sigma,
                                                                 std::mt19937_64& rng) {
  std::normal_distribution<double> normal(0, sigma);
  Eigen::Matrix<double, kImuIntrinsicsSize, 1> intrinsics;
  for (double& value : intrinsics) {
    value = normal(rng);
  }
  return intrinsics;
}

Landmark SeenLandmark(const WindowState& state, int id, const WindowTestOptions& options,
                      std::mt19937_64& rng) {
  std::uniform_real_distribution<double> row(0, options.row_s);
  Landmark landmark;
  landmark.id = id;
  landmark.point.anchor = id % state.Newest();
  landmark.point.anchor_row_s = row(rng);
  const Vector3d p_odom =
      state.frames[0].imu.T_odom_body * (Vector3d(6, 0, 0) + RandomVector(rng, 1));
  const int anchor = landmark.point.anchor;
  const Rigid3 T_odom_cam =
      state.PoseAhead(anchor, state.Ahead(anchor, landmark.point.anchor_row_s)) * state.T_body_cam;
  const Vector3d p_cam = T_odom_cam.Inverse() * p_odom;
  landmark.point.ray_rho = {p_cam.x() / p_cam.z(), p_cam.y() / p_cam.z(), 1 / p_cam.z()};
  for (int i = anchor; i <= state.Newest(); ++i) {
    FrameRay seen;
    seen.frame = i;
    seen.sigma = kRaySigma;
    seen.row_s = i == anchor ? landmark.point.anchor_row_s : row(rng);
    for (int k = 0; k < kIntrinsicsSize; ++k) {
      seen.J_intrinsics.col(k) = RandomVector(rng, 1).head<2>();
    }
    const Vector3d noise = RandomVector(rng, options.ray_noise * kRaySigma);
    // Iterates until the ray equals its prediction.
    for (int k = 0; k < 20; ++k) {
      RowViews rows(state);
      seen.ray = PredictRayOnly(rows, InOdom(rows, landmark.point), seen).value();
    }
    seen.ray += noise.head<2>();
    landmark.rays.push_back(seen);
  }
  return landmark;
}

}  // namespace

std::vector<ImuSample> TestSamples(int count, int64_t first_utime, uint64_t seed) {
  std::mt19937_64 rng(seed);
  std::vector<ImuSample> samples;
  for (int i = 0; i < count; ++i) {
    samples.push_back({first_utime + kSampleStep_us * i,
                       Vector3d(0.1, -0.2, 0.3) + RandomVector(rng, 0.1),
                       Vector3d(0.5, 0.2, 9.9) + RandomVector(rng, 0.3)});
  }
  return samples;
}

Preintegration Integrate(std::span<const ImuSample> samples, const ImuNoise& noise,
                         const Vector3d& gyro_bias, const Vector3d& accel_bias) {
  Preintegrator integrator(noise, gyro_bias, accel_bias);
  integrator.Add(samples);
  return integrator.result();
}

WindowProblem TestWindow(const WindowTestOptions& options) {
  std::mt19937_64 rng(options.seed);
  WindowProblem problem;
  WindowState& state = problem.state;
  // A small rotation and shift of the camera.
  state.T_body_cam = {LookingAhead() * ExpSo3(RandomVector(rng, 0.1)), RandomVector(rng, 0.1)};
  state.time_offset_s = 0.002 + options.late_s;
  state.intrinsics << RandomVector(rng, 0.01), RandomVector(rng, 0.01).head<2>();
  state.interval_share = -0.3;
  state.imu_intrinsics.Add(RandomImuIntrinsics(0.01, rng));
  state.frames = {FirstFrame(0.002, rng)};
  problem.imu_factors.resize(1);
  for (int i = 0; i < options.frames; ++i) {
    if (i > 0) {
      const WindowFrame& last = state.frames.back();
      const auto samples = TestSamples(kSamplesPerImuFactor + 1, last.imu_utime, rng());
      ImuFactor factor;
      ImuIntrinsics imu_intrinsics = state.imu_intrinsics;
      imu_intrinsics.Add(RandomImuIntrinsics(1e-3, rng));
      factor.span = IntegrateScaled(samples, ImuNoise{}, imu_intrinsics,
                                    last.imu.gyro_bias + RandomVector(rng, 1e-3),
                                    last.imu.accel_bias + RandomVector(rng, 1e-2));
      factor.information = InertialInformation(factor.span.measured, ImuNoise{});
      WindowFrame next = last;
      next.stamp_sigma_s = next.stamp_error_s = 0;
      next.imu = Predict(At(factor.span, state.imu_intrinsics), last.imu);
      state.frames.push_back(next);
      problem.imu_factors.emplace_back(factor);
    }
    WindowFrame& frame = state.frames.back();
    frame.imu_utime = 1'000'000 + kSampleStep_us * kSamplesPerImuFactor * i;
    frame.utime = frame.imu_utime - 2'000;
    frame.omega_body = RandomVector(rng, 0.3);
    frame.alpha_body = Vector3d(6, -9, 4);
    frame.a_body = Vector3d(1, -2, 0.5);
    frame.is_window_keyframe = true;
    frame.excess_interval_s = RandomVector(rng, options.interval_sigma_s).x();
    frame.time_offset_s = 0.002 + state.interval_share * frame.excess_interval_s;
    if (options.stamp_sigma_s > 0 && i % 2 == 0) {
      frame.stamp_sigma_s = options.stamp_sigma_s;
      frame.stamp_error_s = RandomVector(rng, options.stamp_sigma_s).x();
    }
  }
  for (int i = 0; i < options.landmarks; ++i) {
    problem.landmarks.push_back(SeenLandmark(state, i, options, rng));
  }
  problem.prior.at = state;
  problem.prior.H.setZero(state.size(), state.size());
  problem.prior.g.setZero(state.size());
  return problem;
}

void HoldStart(WindowProblem* problem, double sigma) {
  problem->prior.H.diagonal().head(kSharedSize + problem->state.frames[0].size()).array() +=
      1 / (sigma * sigma);
}

VectorXd RandomError(const WindowState& state, double sigma, uint64_t seed) {
  std::mt19937_64 rng(seed);
  std::normal_distribution<double> normal(0, sigma);
  VectorXd error(state.size());
  for (double& value : error) {
    value = normal(rng);
  }
  return error;
}

MatrixXd UnobservableDirections(const WindowState& state) {
  MatrixXd N = MatrixXd::Zero(state.size(), 4);
  for (int i = 0; i <= state.Newest(); ++i) {
    N.block<3, 3>(state.FirstRow(i) + kPosition, 0).setIdentity();
    N(state.FirstRow(i) + kTheta + 2, 3) = 1;
  }
  return N;
}

MatrixXd NumericJacobian(const WindowState& state,
                         const std::function<VectorXd(const WindowState&)>& f) {
  return pangea::NumericJacobian(state.size(), 1e-5, [&](const VectorXd& error) {
    WindowState moved = state;
    moved.Retract(error);
    return f(moved);
  });
}

}  // namespace pangea::vio
