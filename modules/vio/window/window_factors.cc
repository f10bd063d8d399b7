#include "vio/window/window_factors.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace pangea::vio {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

// A ray this many sigmas off is pulled at with constant force (Huber, 1964).
constexpr double kHuber = 2.0;
// What a point behind a camera that saw it costs, as a ray this many sigmas off: nothing is gained
// by throwing it there.
constexpr double kBehind = 100;
// Stationary: what may pass for it within the noise of a hundred tracks together.
constexpr double kStationaryVelocitySigma = 0.02;    // m/s
constexpr double kStationaryPositionSigma = 0.002;   // m, between two stationary frames
constexpr double kStationaryRotationSigma = 0.0003;  // rad

double HuberCost(double e) { return e <= kHuber ? 0.5 * e * e : kHuber * (e - 0.5 * kHuber); }
double HuberWeight(double e) { return e <= kHuber ? 1.0 : kHuber / e; }

VectorXd PriorError(const WindowProblem& problem) {
  WindowState state = problem.state;
  state.frames.resize(problem.prior.at.frames.size());
  return Difference(state, problem.prior.at);
}

// One landmark's part of the normal equations, before it is eliminated. Columns as in
// NormalEquations::Elimination, kRay of them for each ray.
struct LandmarkSystem {
  double cost = 0;
  MatrixXd H;
  VectorXd g;
  Matrix3d V = Matrix3d::Zero();
  Eigen::Matrix<double, 3, Eigen::Dynamic> W;
  Vector3d g_point = Vector3d::Zero();
};

// d(ray) by what an anchor or a frame contributes: its pose's error and its stamp's.
template <int kRay>
Eigen::Matrix<double, 2, kRay> FrameJacobian(const Eigen::Matrix<double, 2, kPoseSize>& J_pose,
                                             const Vector2d& J_stamp, const WindowFrame& frame) {
  Eigen::Matrix<double, 2, kRay> J;
  J.template leftCols<kPoseSize>() = J_pose;
  if constexpr (kRay > kPoseSize) {
    J.col(kPoseSize) = frame.has_stamp_error() ? J_stamp : Vector2d::Zero();
  }
  return J;
}

template <int kRay>
void AddRay(const PredictedRay& predicted, const Eigen::Matrix<double, 2, kRay>& J_anchor,
            const Eigen::Matrix<double, 2, kRay>& J_frame, const Vector2d& r, double scale,
            int at_anchor, int at_frame, LandmarkSystem* out) {
  const Eigen::Matrix<double, 2, 3> J_point = scale * predicted.J_point;
  out->V += J_point.transpose() * J_point;
  out->g_point += J_point.transpose() * r;
  const Eigen::Matrix<double, 2, kCalibrationSize> J_c = scale * predicted.J_calibration;
  out->H.topLeftCorner<kCalibrationSize, kCalibrationSize>() += J_c.transpose() * J_c;
  out->W.leftCols<kCalibrationSize>() += J_point.transpose() * J_c;
  out->g.head<kCalibrationSize>() += J_c.transpose() * r;
  if (at_anchor == at_frame) {
    return;  // in its own anchor a point is where its ray is, wherever the frames are
  }
  const Eigen::Matrix<double, 2, kRay> J_a = scale * J_anchor, J_f = scale * J_frame;
  MatrixXd& H = out->H;
  for (const auto& [J, at] : {std::pair(&J_a, at_anchor), std::pair(&J_f, at_frame)}) {
    const Eigen::Matrix<double, kCalibrationSize, kRay> C = J_c.transpose() * *J;
    H.block<kCalibrationSize, kRay>(0, at) += C;
    H.block<kRay, kCalibrationSize>(at, 0) += C.transpose();
    H.block<kRay, kRay>(at, at) += J->transpose() * *J;
    out->W.middleCols<kRay>(at) += J_point.transpose() * *J;
    out->g.segment<kRay>(at) += J->transpose() * r;
  }
  const Eigen::Matrix<double, kRay, kRay> A = J_a.transpose() * J_f;
  H.block<kRay, kRay>(at_anchor, at_frame) += A;
  H.block<kRay, kRay>(at_frame, at_anchor) += A.transpose();
}

template <int kRay>
LandmarkSystem LineariseLandmark(const WindowState& state, const Landmark& landmark) {
  const int m = static_cast<int>(landmark.rays.size());
  const int n = kCalibrationSize + kRay * m;
  LandmarkSystem out;
  out.H.setZero(n, n);
  out.g.setZero(n);
  out.W.setZero(3, n);
  int at_anchor = -1;
  for (int j = 0; j < m; ++j) {
    at_anchor =
        landmark.rays[j].frame == landmark.point.anchor ? kCalibrationSize + kRay * j : at_anchor;
  }
  for (int j = 0; j < m; ++j) {
    const FrameRay& seen = landmark.rays[j];
    const auto predicted = PredictRay(state, landmark.point, seen);
    if (!predicted) {
      out.cost += HuberCost(kBehind);  // and no derivative: it says nothing of where to go
      continue;
    }
    const Vector2d r = (predicted->ray - seen.ray) / seen.sigma;
    const double e = r.norm();
    const double root = std::sqrt(HuberWeight(e));
    out.cost += HuberCost(e);
    AddRay<kRay>(
        *predicted,
        FrameJacobian<kRay>(predicted->J_anchor, predicted->J_anchor_stamp,
                            state.frames[landmark.point.anchor]),
        FrameJacobian<kRay>(predicted->J_frame, predicted->J_frame_stamp, state.frames[seen.frame]),
        root * r, root / seen.sigma, at_anchor, kCalibrationSize + kRay * j, &out);
  }
  return out;
}

// From a landmark's own columns to the window's.
template <int kRay>
void Scatter(const WindowState& state, const Landmark& landmark, const LandmarkSystem& part,
             NormalEquations* out) {
  struct Block {
    int from, to, size;
  };
  std::vector<Block> blocks;
  int from = kCalibrationSize;
  for (const FrameRay& seen : landmark.rays) {
    const int to = state.Offset(seen.frame);
    blocks.push_back({from, to, kPoseSize});
    if (kRay > kPoseSize && state.frames[seen.frame].has_stamp_error()) {
      blocks.push_back({from + kPoseSize, to + kStampError, 1});
    }
    from += kRay;
  }
  constexpr int kC = kCalibrationSize;
  out->H.topLeftCorner<kC, kC>() += part.H.topLeftCorner<kC, kC>();
  out->g.head<kC>() += part.g.head<kC>();
  for (const Block& j : blocks) {
    out->g.segment(j.to, j.size) += part.g.segment(j.from, j.size);
    out->H.block(0, j.to, kC, j.size) += part.H.block(0, j.from, kC, j.size);
    out->H.block(j.to, 0, j.size, kC) += part.H.block(j.from, 0, j.size, kC);
    for (const Block& i : blocks) {
      out->H.block(i.to, j.to, i.size, j.size) += part.H.block(i.from, j.from, i.size, j.size);
    }
  }
}

Vector6d ZeroMotionResidual(const WindowState& state, int to) {
  const Rigid3 T =
      state.frames[to - 1].imu.T_odom_body.Inverse() * state.frames[to].imu.T_odom_body;
  Vector6d r;
  r << LogSo3(T.q) / kStationaryRotationSigma, T.t / kStationaryPositionSigma;
  return r;
}

template <int kRay>
void AddLandmark(const WindowState& state, const Landmark& landmark, double damping,
                 NormalEquations* out) {
  LandmarkSystem part = LineariseLandmark<kRay>(state, landmark);
  Matrix3d V = part.V;
  V.diagonal() *= 1 + damping;
  V.diagonal().array() += 1e-9;
  const Matrix3d V_inverse = V.inverse();
  NormalEquations::Elimination elimination;
  elimination.offset = -V_inverse * part.g_point;
  elimination.gain = -V_inverse * part.W;
  elimination.stamps = kRay > kPoseSize;
  part.H.noalias() += part.W.transpose() * elimination.gain;
  part.g.noalias() += part.W.transpose() * elimination.offset;
  out->cost += part.cost;
  Scatter<kRay>(state, landmark, part, out);
  out->eliminations.push_back(std::move(elimination));
}

}  // namespace

void AddLandmark(const WindowState& state, const Landmark& landmark, double damping,
                 NormalEquations* out) {
  const bool stamps =
      std::any_of(landmark.rays.begin(), landmark.rays.end(),
                  [&](const FrameRay& seen) { return state.frames[seen.frame].has_stamp_error(); });
  stamps ? AddLandmark<kPoseSize + 1>(state, landmark, damping, out)
         : AddLandmark<kPoseSize>(state, landmark, damping, out);
}

void AddImuFactor(const WindowState& state, const ImuFactor& factor, int to, NormalEquations* out) {
  const ImuState& from = state.frames[to - 1].imu;
  const InertialResidual residual =
      ComputeInertialResidual(At(factor.span, state.imu_intrinsics), from, state.frames[to].imu);
  Eigen::Matrix<double, 15, 30> J;
  J << residual.J_from, residual.J_to;
  const Eigen::Matrix<double, 30, 15> JtL = J.transpose() * factor.information;
  const Eigen::Matrix<double, 30, 30> A = JtL * J;
  const Eigen::Matrix<double, 30, 1> b = JtL * residual.r;
  const Eigen::Matrix<double, 15, kImuIntrinsicsSize> J_imu_intrinsics = ImuIntrinsicsJacobian(
      factor.span, state.imu_intrinsics, from.gyro_bias, residual.r.head<3>());
  const Eigen::Matrix<double, kImuIntrinsicsSize, 15> JtL_imu_intrinsics =
      J_imu_intrinsics.transpose() * factor.information;
  const Eigen::Matrix<double, 30, kImuIntrinsicsSize> cross = JtL * J_imu_intrinsics;
  out->H.block<kImuIntrinsicsSize, kImuIntrinsicsSize>(kImuIntrinsics, kImuIntrinsics) +=
      JtL_imu_intrinsics * J_imu_intrinsics;
  const int at[] = {state.Offset(to - 1), state.Offset(to)};
  for (int i = 0; i < 2; ++i) {
    out->g.segment<kFrameSize>(at[i]) += b.segment<kFrameSize>(kFrameSize * i);
    const auto cross_i = cross.middleRows<kFrameSize>(kFrameSize * i);
    out->H.block<kFrameSize, kImuIntrinsicsSize>(at[i], kImuIntrinsics) += cross_i;
    out->H.block<kImuIntrinsicsSize, kFrameSize>(kImuIntrinsics, at[i]) += cross_i.transpose();
    for (int j = 0; j < 2; ++j) {
      out->H.block<kFrameSize, kFrameSize>(at[i], at[j]) +=
          A.block<kFrameSize, kFrameSize>(kFrameSize * i, kFrameSize * j);
    }
  }
  out->g.segment<kImuIntrinsicsSize>(kImuIntrinsics) += JtL_imu_intrinsics * residual.r;
  out->cost += 0.5 * residual.r.dot(factor.information * residual.r);
}

void AddZeroVelocityUpdate(const WindowState& state, int frame, NormalEquations* out) {
  // r = R^T v, so that a rotation of all the frames leaves it as it is also when v is not yet zero;
  // its derivative by xi_v is R^T.
  const Vector3d& v = state.frames[frame].imu.v_odom_body;
  const double information = 1 / (kStationaryVelocitySigma * kStationaryVelocitySigma);
  const int at = state.Offset(frame) + kVelocity;
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
  const int at_i = state.Offset(to - 1), at_j = state.Offset(to);
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
  const int at = state.Offset(frame) + kStampError;
  out->H(at, at) += 1 / (sigma * sigma);
  out->g[at] += error / sigma;
  out->cost += 0.5 * error * error;
}

void AddPrior(const WindowProblem& problem, NormalEquations* out) {
  const WindowPrior& prior = problem.prior;
  const VectorXd e = PriorError(problem);
  const VectorXd He = prior.H * e;
  // The prior's derivatives stay those of its own linearisation: the unobservable directions are
  // the same here and there.
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
  for (const Landmark& landmark : problem.landmarks) {
    for (const FrameRay& seen : landmark.rays) {
      const double error = RayError(state, landmark.point, seen);
      cost += HuberCost(std::isfinite(error) ? error : kBehind);
    }
  }
  return cost;
}

double RayError(const WindowState& state, const AnchoredPoint& point, const FrameRay& seen) {
  const auto ray = PredictRayOnly(state, point, seen);
  return ray ? (*ray - seen.ray).norm() / seen.sigma : std::numeric_limits<double>::infinity();
}

}  // namespace pangea::vio
