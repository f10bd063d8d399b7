#include "vio/window/window_factors.h"

#include <cmath>

#include "vio/window/landmarks/landmark_factor.h"
#include "vio/window/nine_columns.h"

namespace pangea::vio {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

// Sigmas of a stationary frame: motion that the noise of a hundred tracks together can hide.
constexpr double kStationaryPositionSigma = 0.002;   // m, between two stationary frames
constexpr double kStationaryRotationSigma = 0.0003;  // rad

VectorXd PriorError(const WindowProblem& problem) {
  WindowState state = problem.state;
  state.frames.resize(problem.prior.at.frames.size());
  return Difference(state, problem.prior.at);
}

Vector6d ZeroMotionResidual(const WindowState& state, int to) {
  const Rigid3 T =
      state.frames[to - 1].imu.T_odom_body.Inverse() * state.frames[to].imu.T_odom_body;
  Vector6d r;
  r << LogSo3(T.q) / kStationaryRotationSigma, T.t / kStationaryPositionSigma;
  return r;
}

}  // namespace

// Rows of Jt: IMU intrinsics; frame i; pose and velocity of frame j. This is the window's order, as
// only the upper triangle of H is filled. The residuals of the biases' random walks, whose
// information is diagonal, are added separately.
void AddImuFactor(const WindowState& state, const ImuFactor& factor, int to, NormalEquations* out) {
  constexpr int kMotion = 9;  // number of residuals, and of errors of frame j
  constexpr int kErrors = kImuIntrinsicsSize + kFrameSize + kMotion;
  const ImuState& from = state.frames[to - 1].imu;
  const InertialResidual residual =
      ComputeInertialResidual(At(factor.span, state.imu_intrinsics), from, state.frames[to].imu);
  NineColumns Jt(kErrors, kMotion);
  Jt << ImuIntrinsicsJacobian(factor.span, state.imu_intrinsics, from.gyro_bias,
                              residual.r.head<3>())
            .topRows<kMotion>()
            .transpose(),
      residual.J_from.topRows<kMotion>().transpose(),
      residual.J_to.topLeftCorner<kMotion, kMotion>().transpose();
  NineColumns minus_JtL = NineColumns::Zero(kErrors, kMotion);
  SubtractProduct(Jt, factor.information.topLeftCorner<kMotion, kMotion>(), &minus_JtL);
  MatrixXd A = MatrixXd::Zero(kErrors, kErrors);
  SubtractUpperProduct(minus_JtL, Jt, A);
  const Eigen::Matrix<double, kErrors, 1> b = -minus_JtL * residual.r.head<kMotion>();
  struct Part {
    int at, begin, size;
  };
  const Part parts[] = {{kImuIntrinsics, 0, kImuIntrinsicsSize},
                        {state.FirstRow(to - 1), kImuIntrinsicsSize, kFrameSize},
                        {state.FirstRow(to), kImuIntrinsicsSize + kFrameSize, kMotion}};
  for (const Part& column : parts) {
    out->g.segment(column.at, column.size) += b.segment(column.begin, column.size);
    for (const Part& row : parts) {
      out->H.block(row.at, column.at, row.size, column.size) +=
          A.block(row.begin, column.begin, row.size, column.size);
      if (&row == &column) {
        break;
      }
    }
  }
  const Vector6d walk = factor.information.diagonal().tail<6>();
  const Vector6d pull = walk.cwiseProduct(residual.r.tail<6>());
  const int at_i = state.FirstRow(to - 1) + kGyroBias, at_j = state.FirstRow(to) + kGyroBias;
  out->H.diagonal().segment<6>(at_i) += walk;
  out->H.diagonal().segment<6>(at_j) += walk;
  out->H.block<6, 6>(at_i, at_j).diagonal() -= walk;
  out->g.segment<6>(at_i) -= pull;
  out->g.segment<6>(at_j) += pull;
  out->cost += 0.5 * residual.r.dot(factor.information * residual.r);
}

void AddZeroVelocityUpdate(const WindowState& state, int frame, NormalEquations* out) {
  // r = R^T v does not change if all frames are rotated, even while v is not zero; its derivative
  // with respect to xi_v is R^T.
  const Vector3d& v = state.frames[frame].imu.v_odom_body;
  const double information = 1 / (kStationaryVelocitySigma * kStationaryVelocitySigma);
  const int at = state.FirstRow(frame) + kVelocity;
  out->H.diagonal().segment<3>(at).array() += information;
  out->g.segment<3>(at) += information * v;
  out->cost += 0.5 * information * v.squaredNorm();
}

bool StationaryTogether(const WindowProblem& problem, int to) {
  return problem.imu_factors[to] && problem.state.frames[to - 1].stationary &&
         problem.state.frames[to].stationary;
}

void AddZeroMotionUpdate(const WindowState& state, int to, NormalEquations* out) {
  const Rigid3& T_i = state.frames[to - 1].imu.T_odom_body;
  const Rigid3& T_j = state.frames[to].imu.T_odom_body;
  const Vector6d r = ZeroMotionResidual(state, to);
  const Matrix3d R_i = T_i.R().transpose();
  const Matrix3d rotation = RightJacobianInverse(kStationaryRotationSigma * r.head<3>()) *
                            T_j.R().transpose() / kStationaryRotationSigma;
  Eigen::Matrix<double, 6, 12> J = Eigen::Matrix<double, 6, 12>::Zero();  // (pose i, pose j)
  J.block<3, 3>(0, 0) = -rotation;
  J.block<3, 3>(0, 6) = rotation;
  J.block<3, 3>(3, 0) = R_i * Hat(T_j.t) / kStationaryPositionSigma;
  J.block<3, 3>(3, 3) = -R_i / kStationaryPositionSigma;
  J.block<3, 3>(3, 6) = -R_i * Hat(T_j.t) / kStationaryPositionSigma;
  J.block<3, 3>(3, 9) = R_i / kStationaryPositionSigma;
  const Eigen::Matrix<double, 12, 12> A = J.transpose() * J;
  const Eigen::Matrix<double, 12, 1> b = J.transpose() * r;
  const int at_i = state.FirstRow(to - 1), at_j = state.FirstRow(to);
  out->H.block<6, 6>(at_i, at_i) += A.topLeftCorner<6, 6>();
  out->H.block<6, 6>(at_i, at_j) += A.topRightCorner<6, 6>();
  out->H.block<6, 6>(at_j, at_i) += A.bottomLeftCorner<6, 6>();
  out->H.block<6, 6>(at_j, at_j) += A.bottomRightCorner<6, 6>();
  out->g.segment<6>(at_i) += b.head<6>();
  out->g.segment<6>(at_j) += b.tail<6>();
  out->cost += 0.5 * r.squaredNorm();
}

void AddStampError(const WindowState& state, int frame, NormalEquations* out) {
  const double sigma = state.frames[frame].stamp_sigma_s;
  const double error = state.frames[frame].stamp_error_s / sigma;
  const int at = state.FirstRow(frame) + kStampError;
  out->H(at, at) += 1 / (sigma * sigma);
  out->g[at] += error / sigma;
  out->cost += 0.5 * error * error;
}

void AddPrior(const WindowProblem& problem, NormalEquations* out) {
  const WindowPrior& prior = problem.prior;
  const VectorXd e = PriorError(problem);
  const VectorXd He = prior.H * e;
  // The prior keeps the derivatives of its own linearisation point: there and at the present state
  // the unobservable directions are the same.
  out->H.topLeftCorner(prior.H.rows(), prior.H.cols()) += prior.H;
  out->g.head(prior.g.size()) += prior.g + He;
  out->cost += prior.g.dot(e) + 0.5 * e.dot(He);
}

double Cost(const WindowProblem& problem) {
  const WindowState& state = problem.state;
  const VectorXd e = PriorError(problem);
  double cost = problem.prior.g.dot(e) + 0.5 * e.dot(problem.prior.H * e);
  for (int i = 1; i <= state.Newest(); ++i) {
    if (problem.imu_factors[i]) {
      const ImuFactor& factor = *problem.imu_factors[i];
      const auto residual = ComputeInertialResidual(At(factor.span, state.imu_intrinsics),
                                                    state.frames[i - 1].imu, state.frames[i].imu);
      cost += 0.5 * residual.r.dot(factor.information * residual.r);
    }
    if (StationaryTogether(problem, i)) {
      cost += 0.5 * ZeroMotionResidual(state, i).squaredNorm();
    }
  }
  for (const WindowFrame& frame : state.frames) {
    if (frame.stationary) {
      cost += 0.5 * frame.imu.v_odom_body.squaredNorm() /
              (kStationaryVelocitySigma * kStationaryVelocitySigma);
    }
    if (frame.has_stamp_error()) {
      cost += 0.5 * std::pow(frame.stamp_error_s / frame.stamp_sigma_s, 2);
    }
  }
  RowViews rows(state);
  for (const Landmark& landmark : problem.landmarks) {
    cost += LandmarkCost(rows, landmark);
  }
  return cost;
}

}  // namespace pangea::vio
