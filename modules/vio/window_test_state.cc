#include "vio/window_test_state.h"

namespace pangea::vio {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

Vector3d RandomVector(std::mt19937_64& rng, double sigma) {
  std::normal_distribution<double> normal(0, sigma);
  const double x = normal(rng), y = normal(rng), z = normal(rng);
  return {x, y, z};
}

WindowState TestWindow(int clones, int landmarks, uint64_t seed) {
  std::mt19937_64 rng(seed);
  WindowState state;
  // The camera looks along the body's x axis, a little askew.
  Eigen::Matrix3d R_body_cam;
  R_body_cam << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  state.T_body_cam = {Eigen::Quaterniond(R_body_cam) * ExpSo3(RandomVector(rng, 0.1)),
                      RandomVector(rng, 0.1)};
  const Vector3d origin(3, -2, 1);  // far from zero: where wrong position columns show
  const auto pose = [&] {
    return Rigid3(ExpSo3(RandomVector(rng, 0.15)), origin + RandomVector(rng, 0.5));
  };
  state.imu.T_odom_body = pose();
  state.imu.v_odom_body = RandomVector(rng, 1);
  state.imu.gyro_bias = RandomVector(rng, 0.02);
  state.imu.accel_bias = RandomVector(rng, 0.1);
  state.time_offset_s = 0.002;
  for (int i = 0; i < clones; ++i) {
    Clone clone;
    clone.utime = 1'000'000 + 50'000 * i;
    clone.T_odom_body = pose();
    clone.v_odom_body = RandomVector(rng, 1);
    state.clones.push_back(clone);
  }
  for (int i = 0; i < landmarks; ++i) {
    const Vector3d p_odom = origin + Vector3d(6, 0, 0) + RandomVector(rng, 1);
    const Clone& anchor = state.clones[i % clones];
    const Vector3d p_cam = (anchor.T_odom_body * state.T_body_cam).Inverse() * p_odom;
    state.landmarks.emplace_back(
        100 + i,
        AnchoredPoint{anchor.utime, {p_cam.x() / p_cam.z(), p_cam.y() / p_cam.z(), 1 / p_cam.z()}});
  }
  const int n = state.size();
  MatrixXd A(n, n);
  std::normal_distribution<double> normal(0, 0.01);
  for (int row = 0; row < n; ++row) {
    for (int col = 0; col < n; ++col) {
      A(row, col) = normal(rng);
    }
  }
  state.covariance = A * A.transpose() / n + 1e-5 * MatrixXd::Identity(n, n);
  return state;
}

VectorXd Difference(const WindowState& a, const WindowState& b) {
  VectorXd e(b.size());
  const auto pose = [&](int theta, int xi, const Rigid3& Ta, const Rigid3& Tb) {
    const Eigen::Quaterniond turn = Ta.q * Tb.q.conjugate();
    e.segment<3>(theta) = LogSo3(turn);
    e.segment<3>(xi) = Ta.t - turn * Tb.t;
  };
  pose(kTheta, kPosition, a.imu.T_odom_body, b.imu.T_odom_body);
  e.segment<3>(kVelocity) =
      a.imu.v_odom_body -
      a.imu.T_odom_body.q * (b.imu.T_odom_body.q.conjugate() * b.imu.v_odom_body);
  e.segment<3>(kGyroBias) = a.imu.gyro_bias - b.imu.gyro_bias;
  e.segment<3>(kAccelBias) = a.imu.accel_bias - b.imu.accel_bias;
  e.segment<3>(kExtrinsics) = LogSo3(a.T_body_cam.q * b.T_body_cam.q.conjugate());
  e.segment<3>(kExtrinsics + 3) = a.T_body_cam.t - b.T_body_cam.t;
  e[kTimeOffset] = a.time_offset_s - b.time_offset_s;
  for (size_t i = 0; i < b.clones.size(); ++i) {
    const int at = b.CloneOffset(static_cast<int>(i));
    pose(at, at + 3, a.clones[i].T_odom_body, b.clones[i].T_odom_body);
  }
  for (size_t i = 0; i < b.landmarks.size(); ++i) {
    e.segment<3>(b.LandmarkOffset(static_cast<int>(i))) =
        a.landmarks[i].second.ray_rho - b.landmarks[i].second.ray_rho;
  }
  return e;
}

MatrixXd UnobservableDirections(const WindowState& state) {
  MatrixXd N = MatrixXd::Zero(state.size(), 4);
  N.block<3, 3>(kPosition, 0).setIdentity();
  N(kTheta + 2, 3) = 1;
  for (int i = 0; i < static_cast<int>(state.clones.size()); ++i) {
    N.block<3, 3>(state.CloneOffset(i) + 3, 0).setIdentity();
    N(state.CloneOffset(i) + 2, 3) = 1;
  }
  return N;
}

}  // namespace pangea::vio
