#include "vio/window_filter.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>

namespace pangea::vio {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using Matrix15d = Eigen::Matrix<double, 15, 15>;

const Vector3d kGravityVector(0, 0, -kGravity);

// One step of the IMU state and its error: d(error)/dt = F error + G n (derivation in
// docs/maths_vio.md).
void Step(const ImuSample& a, const ImuSample& b, const ImuNoise& noise, ImuState* imu,
          Matrix15d* Phi, Matrix15d* Q) {
  const double dt = 1e-6 * static_cast<double>(b.utime - a.utime);
  if (dt <= 0) {
    return;
  }
  const Vector3d omega = 0.5 * (a.gyro + b.gyro) - imu->gyro_bias;
  const Vector3d force = 0.5 * (a.accel + b.accel) - imu->accel_bias;
  Rigid3& T = imu->T_odom_body;
  const Matrix3d R_mid = (T.q * ExpSo3(0.5 * dt * omega)).toRotationMatrix();
  const Vector3d accel = R_mid * force + kGravityVector;
  const Vector3d v_mid = imu->v_odom_body + 0.5 * dt * accel;
  const Vector3d p_mid = T.t + 0.5 * dt * imu->v_odom_body + 0.125 * dt * dt * accel;

  Matrix15d F = Matrix15d::Zero();
  F.block<3, 3>(kTheta, kGyroBias) = -R_mid;
  F.block<3, 3>(kPosition, kVelocity).setIdentity();
  F.block<3, 3>(kPosition, kGyroBias) = -Hat(p_mid) * R_mid;
  F.block<3, 3>(kVelocity, kTheta) = Hat(kGravityVector);
  F.block<3, 3>(kVelocity, kGyroBias) = -Hat(v_mid) * R_mid;
  F.block<3, 3>(kVelocity, kAccelBias) = -R_mid;
  const Matrix15d Fdt = F * dt;
  const Matrix15d Phi_step = Matrix15d::Identity() + Fdt + 0.5 * Fdt * Fdt;

  Eigen::Matrix<double, 15, 12> G = Eigen::Matrix<double, 15, 12>::Zero();
  G.block<3, 3>(kTheta, 0) = R_mid;
  G.block<3, 3>(kPosition, 0) = Hat(p_mid) * R_mid;
  G.block<3, 3>(kVelocity, 0) = Hat(v_mid) * R_mid;
  G.block<3, 3>(kVelocity, 3) = R_mid;
  G.block<3, 3>(kGyroBias, 6).setIdentity();
  G.block<3, 3>(kAccelBias, 9).setIdentity();
  Eigen::Matrix<double, 12, 1> density;
  density << Vector3d::Constant(noise.gyro_noise_density),
      Vector3d::Constant(noise.accel_noise_density), Vector3d::Constant(noise.gyro_random_walk),
      Vector3d::Constant(noise.accel_random_walk);
  const Eigen::Matrix<double, 12, 1> variance = density.cwiseAbs2() * dt;
  *Q = Phi_step * (*Q) * Phi_step.transpose() + G * variance.asDiagonal() * G.transpose();
  *Phi = Phi_step * (*Phi);

  T.t += dt * imu->v_odom_body + 0.5 * dt * dt * accel;
  imu->v_odom_body += dt * accel;
  T.q = (T.q * ExpSo3(dt * omega)).normalized();
}

// Keeps the rows and columns of `m` outside [at, at + count).
MatrixXd Without(const MatrixXd& m, int at, int count) {
  const int n = static_cast<int>(m.rows());
  const int rest = n - at - count;
  MatrixXd out(n - count, n - count);
  out.topLeftCorner(at, at) = m.topLeftCorner(at, at);
  out.topRightCorner(at, rest) = m.topRightCorner(at, rest);
  out.bottomLeftCorner(rest, at) = m.bottomLeftCorner(rest, at);
  out.bottomRightCorner(rest, rest) = m.bottomRightCorner(rest, rest);
  return out;
}

// Grows `m` by `count` rows and columns of zeros at `at`.
MatrixXd WithRoom(const MatrixXd& m, int at, int count) {
  const int n = static_cast<int>(m.rows());
  const int rest = n - at;
  MatrixXd out = MatrixXd::Zero(n + count, n + count);
  out.topLeftCorner(at, at) = m.topLeftCorner(at, at);
  out.topRightCorner(at, rest) = m.topRightCorner(at, rest);
  out.bottomLeftCorner(rest, at) = m.bottomLeftCorner(rest, at);
  out.bottomRightCorner(rest, rest) = m.bottomRightCorner(rest, rest);
  return out;
}

// More rows than unknowns say no more than their triangular factor does.
Measurement Compressed(const Measurement& m) {
  if (m.H.rows() <= m.H.cols()) {
    return m;
  }
  const Eigen::HouseholderQR<MatrixXd> qr(m.H);
  Measurement out;
  out.H = qr.matrixQR().topRows(m.H.cols()).triangularView<Eigen::Upper>();
  VectorXd r = m.r;
  r.applyOnTheLeft(qr.householderQ().adjoint());
  out.r = r.head(m.H.cols());
  return out;
}

}  // namespace

WindowFilter::WindowFilter(const ImuNoise& noise, WindowState initial)
    : noise_(noise), state_(std::move(initial)) {}

void WindowFilter::Propagate(std::span<const ImuSample> samples) {
  Matrix15d Phi = Matrix15d::Identity();
  Matrix15d Q = Matrix15d::Zero();
  for (size_t i = 0; i + 1 < samples.size(); ++i) {
    Step(samples[i], samples[i + 1], noise_, &state_.imu, &Phi, &Q);
  }
  MatrixXd& P = state_.covariance;
  const int rest = static_cast<int>(P.cols()) - 15;
  P.topLeftCorner<15, 15>() = Phi * P.topLeftCorner<15, 15>() * Phi.transpose() + Q;
  P.topRightCorner(15, rest) = (Phi * P.topRightCorner(15, rest)).eval();
  P.bottomLeftCorner(rest, 15) = P.topRightCorner(15, rest).transpose();
}

void WindowFilter::AddClone(int64_t utime, const Vector3d& omega_body) {
  const ImuState& imu = state_.imu;
  const int at = state_.CloneOffset(static_cast<int>(state_.clones.size()));
  const int n = state_.size();
  // The image was taken at t + time offset: an error of the offset moves the pose along its motion.
  const Vector3d omega_odom = imu.T_odom_body.q * omega_body;
  MatrixXd J = MatrixXd::Zero(kCloneSize, n);
  J.block<3, 3>(0, kTheta).setIdentity();
  J.block<3, 3>(3, kPosition).setIdentity();
  J.block<3, 1>(0, kTimeOffset) = omega_odom;
  J.block<3, 1>(3, kTimeOffset) = imu.v_odom_body + imu.T_odom_body.t.cross(omega_odom);
  const MatrixXd JP = J * state_.covariance;
  const MatrixXd JPJ = JP * J.transpose();
  MatrixXd& P = state_.covariance;
  P = WithRoom(P, at, kCloneSize);
  const int rest = n - at;
  P.block(at, 0, kCloneSize, at) = JP.leftCols(at);
  P.block(at, at + kCloneSize, kCloneSize, rest) = JP.rightCols(rest);
  P.block(0, at, at, kCloneSize) = JP.leftCols(at).transpose();
  P.block(at + kCloneSize, at, rest, kCloneSize) = JP.rightCols(rest).transpose();
  P.block(at, at, kCloneSize, kCloneSize) = JPJ;
  Clone clone;
  clone.utime = utime;
  clone.T_odom_body = imu.T_odom_body;
  clone.v_odom_body = imu.v_odom_body;
  clone.gyro_bias = imu.gyro_bias;
  clone.accel_bias = imu.accel_bias;
  state_.clones.push_back(clone);
}

void WindowFilter::RemoveClone(int index) {
  state_.covariance = Without(state_.covariance, state_.CloneOffset(index), kCloneSize);
  state_.clones.erase(state_.clones.begin() + index);
}

void WindowFilter::RemoveLandmark(int index) {
  state_.covariance = Without(state_.covariance, state_.LandmarkOffset(index), kLandmarkSize);
  state_.landmarks.erase(state_.landmarks.begin() + index);
}

void WindowFilter::AddLandmark(int32_t landmark_id, const AnchoredPoint& point,
                               const Measurement& x, const MatrixXd& H_f, double sigma) {
  // Q^T (r, Hx, Hf): the first three rows see the landmark, the others only the state.
  const Eigen::HouseholderQR<MatrixXd> qr(H_f);
  MatrixXd H = x.H;
  VectorXd r = x.r;
  H.applyOnTheLeft(qr.householderQ().adjoint());
  r.applyOnTheLeft(qr.householderQ().adjoint());
  const Matrix3d U = qr.matrixQR().topRows<3>().triangularView<Eigen::Upper>();
  const Matrix3d U_inv = U.inverse();

  const int n = state_.size();
  const MatrixXd H1 = H.topRows<3>();
  const MatrixXd P_fx = -U_inv * H1 * state_.covariance;
  const Matrix3d P_ff =
      U_inv * (H1 * state_.covariance * H1.transpose() + sigma * sigma * Matrix3d::Identity()) *
      U_inv.transpose();
  MatrixXd& P = state_.covariance;
  P = WithRoom(P, n, kLandmarkSize);
  P.bottomLeftCorner(3, n) = P_fx;
  P.topRightCorner(n, 3) = P_fx.transpose();
  P.bottomRightCorner<3, 3>() = P_ff;
  AnchoredPoint placed = point;
  placed.ray_rho += U_inv * r.head<3>();
  state_.landmarks.emplace_back(landmark_id, placed);

  const int rest = static_cast<int>(H.rows()) - 3;
  if (rest > 0) {
    Measurement left;
    left.H = MatrixXd::Zero(rest, n + 3);
    left.H.leftCols(n) = H.bottomRows(rest);
    left.r = r.tail(rest);
    Update(left, sigma);
  }
}

void WindowFilter::ReplaceLandmark(int index, const AnchoredPoint& point, const MatrixXd& J) {
  const int at = state_.LandmarkOffset(index);
  MatrixXd& P = state_.covariance;
  const MatrixXd JP = J * P;
  const Matrix3d JPJ = JP * J.transpose();
  P.middleRows(at, 3) = JP;
  P.middleCols(at, 3) = JP.transpose();
  P.block<3, 3>(at, at) = JPJ;
  state_.landmarks[index].second = point;
}

double WindowFilter::Nis(const Measurement& m, double sigma) const {
  MatrixXd S = m.H * state_.covariance * m.H.transpose();
  S.diagonal().array() += sigma * sigma;
  return m.r.dot(S.llt().solve(m.r));
}

void WindowFilter::Update(const Measurement& measurement, double sigma) {
  const Measurement m = Compressed(measurement);
  MatrixXd& P = state_.covariance;
  const MatrixXd PHt = P * m.H.transpose();
  MatrixXd S = m.H * PHt;
  S.diagonal().array() += sigma * sigma;
  const Eigen::LLT<MatrixXd> llt(S);
  // P - P Ht S^-1 H P through the triangular factor stays symmetric.
  const MatrixXd W = llt.matrixL().solve(PHt.transpose());
  P.noalias() -= W.transpose() * W;
  state_.Retract(PHt * llt.solve(m.r));
}

}  // namespace pangea::vio
