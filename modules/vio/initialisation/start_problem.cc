#include "vio/initialisation/start_problem.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

#include "core/least_squares/levenberg_marquardt.h"
#include "core/least_squares/robust_loss.h"

namespace pangea::vio {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;
using Equations = StartProblem::Equations;

constexpr double kGyroBiasSigma = 0.02;  // rad/s, about the epipolar solution
constexpr double kHeld = 1e-8;           // rad^2, m^2: the first frame's yaw and position
constexpr double kStartHuber = 2.0;      // sigmas
constexpr double kMinStartDepth = 0.05;  // m
// The iteration stops if the predicted decrease of the cost is below this (0.5 is one sigma of one
// direction).
constexpr double kEnough = 1e-3;
constexpr int kMaxRetries = 8;
// The same for the optimisation of a single point.
constexpr double kPointEnough = 1e-4;
constexpr int kPointIterations = 3;
// relative, of an inverse depth in one step: at most ten times as far
constexpr double kMaxRetreat = 0.9;

// A ray's residual in sigmas, and its Jacobians: the frame's pose, the point in odom.
struct RayTerm {
  Vector2d r;
  Eigen::Matrix<double, 2, kPoseSize> J_pose;
  Eigen::Matrix<double, 2, 3> J_point;
};

// The camera poses at the times of the images.
struct Cameras {
  struct Camera {
    Matrix3d R_cam_odom;
    Vector3d p_odom_cam;
  };
  std::vector<Camera> of_frame;
  double ray_sigma = 0;
};

Cameras CamerasOf(const StartProblem& problem) {
  Cameras cameras;
  cameras.ray_sigma = problem.ray_sigma;
  for (int i = 0; i < problem.num_frames(); ++i) {
    const Rigid3 T_odom_cam = problem.ImagePose(i) * problem.T_body_cam;
    cameras.of_frame.push_back({T_odom_cam.R().transpose(), T_odom_cam.t});
  }
  return cameras;
}

double RayError(const Cameras& cameras, const StartRay& seen, const Vector3d& p_odom) {
  const auto& [R_cam_odom, p_odom_cam] = cameras.of_frame[seen.frame];
  const Vector3d y = R_cam_odom * (p_odom - p_odom_cam);
  return y.z() > kMinStartDepth ? (y.head<2>() / y.z() - seen.ray).norm() / cameras.ray_sigma
                                : std::numeric_limits<double>::infinity();
}

double PointCost(const Cameras& cameras, const StartPoint& point, const Vector3d& p_odom) {
  const double sigma = point.expected_sigma;
  double cost = 0.5 * (p_odom - point.expected).squaredNorm() / (sigma * sigma);
  for (const StartRay& seen : point.rays) {
    cost += HuberCost(RayError(cameras, seen, p_odom), kStartHuber);
  }
  return cost;
}

RayTerm LineariseRay(const Cameras& cameras, const StartRay& seen, const Vector3d& p_odom) {
  const auto& [R_cam_odom, p_odom_cam] = cameras.of_frame[seen.frame];
  const Vector3d y = R_cam_odom * (p_odom - p_odom_cam);
  const double inv = 1 / y.z();
  Eigen::Matrix<double, 2, 3> J;
  J << inv, 0, -y.x() * inv * inv, 0, inv, -y.y() * inv * inv;
  RayTerm term;
  term.r = (y.head<2>() * inv - seen.ray) / cameras.ray_sigma;
  term.J_point = J * R_cam_odom / cameras.ray_sigma;
  term.J_pose << term.J_point * Hat(p_odom), -term.J_point;
  const double root = std::sqrt(HuberWeight(term.r.norm(), kStartHuber));
  term.r *= root;
  term.J_point *= root;
  term.J_pose *= root;
  return term;
}

Equations::Elimination AddPoint(const StartProblem& problem, const Cameras& cameras,
                                const StartPoint& point, double damping, Equations* out) {
  const int first = point.rays.front().frame;
  const int columns = kPoseSize * (point.rays.back().frame - first + 1);
  const double prior = 1 / (point.expected_sigma * point.expected_sigma);
  Matrix3d V = prior * Matrix3d::Identity();
  Vector3d g_point = prior * (point.p_odom - point.expected);
  Eigen::Matrix<double, 3, Eigen::Dynamic> W(3, columns);
  W.setZero();
  for (const StartRay& seen : point.rays) {
    const RayTerm term = LineariseRay(cameras, seen, point.p_odom);
    const int at = problem.PoseColumn(seen.frame);
    out->H.block<kPoseSize, kPoseSize>(at, at) += term.J_pose.transpose() * term.J_pose;
    out->g.segment<kPoseSize>(at) += term.J_pose.transpose() * term.r;
    W.middleCols<kPoseSize>(kPoseSize * (seen.frame - first)) =
        term.J_point.transpose() * term.J_pose;
    V += term.J_point.transpose() * term.J_point;
    g_point += term.J_point.transpose() * term.r;
  }
  V.diagonal() *= 1 + damping;
  // With V = L L^T, the Schur complement is H - S^T S, S = L^-1 W.
  const Eigen::LLT<Matrix3d> llt(V);
  const Eigen::Matrix<double, 3, Eigen::Dynamic> S = llt.matrixL().solve(W);
  const Vector3d d = llt.matrixL().solve(g_point);
  const int at = problem.PoseColumn(first);
  for (int c = 0; c < columns; ++c) {
    out->H.col(at + c).segment(at + c, columns - c).noalias() -=
        S.rightCols(columns - c).transpose().lazyProduct(S.col(c));
  }
  out->g.segment(at, columns).noalias() -= S.transpose() * d;
  return {first, -llt.matrixU().solve(d), -llt.matrixU().solve(S)};
}

// Optimises a point alone, from its present position or from `offered`, whichever has the lower
// cost. Uses inverse depth in the camera that saw the point first: rays are nearly linear in it.
void Settle(const Cameras& cameras, const Vector3d& offered, StartPoint* point) {
  double cost = PointCost(cameras, *point, point->p_odom);
  const auto improve = [&](const Vector3d& p_odom) {
    const double new_cost = PointCost(cameras, *point, p_odom);
    if (new_cost < cost) {
      cost = new_cost;
      point->p_odom = p_odom;
      return true;
    }
    return false;
  };
  improve(offered);
  const Vector3d& centre = cameras.of_frame[point->rays.front().frame].p_odom_cam;
  for (int iteration = 0; iteration < kPointIterations && std::isfinite(cost); ++iteration) {
    const double prior = 1 / (point->expected_sigma * point->expected_sigma);
    Matrix3d V = prior * Matrix3d::Identity();
    Vector3d g = prior * (point->p_odom - point->expected);
    for (const StartRay& seen : point->rays) {
      const RayTerm term = LineariseRay(cameras, seen, point->p_odom);
      V += term.J_point.transpose() * term.J_point;
      g += term.J_point.transpose() * term.r;
    }
    const Vector3d step = -V.llt().solve(g);
    if (-0.5 * g.dot(step) < kPointEnough) {
      return;
    }
    const Vector3d r = point->p_odom - centre;
    const double along = r.dot(step) / r.squaredNorm();
    if (!improve(centre + (r + step - along * r) / (1 - std::min(along, kMaxRetreat)))) {
      return;
    }
  }
}

// Derivative of (dtheta, xi_p, xi_v) at the stamp with respect to the stamp's error, for a fixed
// image pose.
Eigen::Matrix<double, 9, 1> ByStampError(const StartProblem& problem, int frame) {
  const ImuState& state = problem.states[frame];
  const Vector3d omega = state.T_odom_body.q * problem.stamps[frame].omega_body;
  const Vector3d& v = state.v_odom_body;
  Eigen::Matrix<double, 9, 1> change;
  change << -omega, omega.cross(state.T_odom_body.t) - v, omega.cross(v);
  return change;
}

// Derivatives with respect to a frame's (dtheta, xi_p, xi_v, e), from those with respect to its
// pose and velocity at the stamp.
using FrameJacobian = Eigen::Matrix<double, 9, kPoseSize + 4>;
FrameJacobian ByFrame(const StartProblem& problem, int frame,
                      const Eigen::Matrix<double, 9, 9>& J_stamp) {
  FrameJacobian J;
  J << J_stamp, J_stamp * ByStampError(problem, frame);
  J.middleCols<3>(kVelocity) -= problem.StampError(frame) * J_stamp.middleCols<3>(kPosition);
  return J;
}

// Columns of a frame's (dtheta, xi_p, xi_v, e).
std::vector<int> FrameColumns(const StartProblem& problem, int frame) {
  std::vector<int> columns(kPoseSize + 3);
  std::iota(columns.begin(), columns.begin() + kPoseSize, problem.PoseColumn(frame));
  std::iota(columns.begin() + kPoseSize, columns.end(), problem.VelocityColumn(frame));
  if (problem.stamps_jitter()) {
    columns.push_back(problem.StampColumn(frame));
  }
  return columns;
}

void AddImuFactor(const StartProblem& problem, int from, Equations* out) {
  const StartImuFactor& factor = problem.imu_factors[from];
  const InertialResidual residual =
      ComputeInertialResidual(factor.measured, problem.states[from], problem.states[from + 1]);
  const FrameJacobian J_from = ByFrame(problem, from, residual.J_from.block<9, 9>(0, 0));
  const FrameJacobian J_to = ByFrame(problem, from + 1, residual.J_to.block<9, 9>(0, 0));
  std::vector<int> columns = {0, 1, 2, 3, 4, 5, StartProblem::kTimeOffsetColumn};
  const std::vector<int> of_from = FrameColumns(problem, from);
  const std::vector<int> of_to = FrameColumns(problem, from + 1);
  columns.insert(columns.end(), of_from.begin(), of_from.end());
  columns.insert(columns.end(), of_to.begin(), of_to.end());
  const auto count = static_cast<Eigen::Index>(of_from.size());
  MatrixXd J(9, columns.size());
  J << residual.J_from.block<9, 6>(0, kGyroBias), J_from.rightCols<1>() + J_to.rightCols<1>(),
      J_from.leftCols(count), J_to.leftCols(count);
  const MatrixXd JtL = J.transpose() * factor.information;
  out->H(columns, columns) += JtL * J;
  out->g(columns) += JtL * residual.r.head<9>();
}

// The priors of the stamp errors: zero mean, with their sigmas.
void AddStamps(const StartProblem& problem, Equations* out) {
  const auto add = [out](int column, double error_s, double sigma_s) {
    out->H(column, column) += 1 / (sigma_s * sigma_s);
    out->g[column] += error_s / (sigma_s * sigma_s);
  };
  add(StartProblem::kTimeOffsetColumn, problem.time_offset_error_s, problem.time_offset_sigma_s);
  for (int i = 0; problem.stamps_jitter() && i < problem.num_frames(); ++i) {
    add(problem.StampColumn(i), problem.stamps[i].error_s, problem.stamp_sigma_s);
  }
}

}  // namespace

Rigid3 StartProblem::ImagePose(int frame) const {
  const Rigid3& T = states[frame].T_odom_body;
  const double error_s = StampError(frame);
  return {T.q * ExpSo3(error_s * stamps[frame].omega_body),
          T.t + error_s * states[frame].v_odom_body};
}

double StartProblem::Cost() const {
  double cost = 0.5 * (states[0].gyro_bias - expected_gyro_bias).squaredNorm() /
                    (kGyroBiasSigma * kGyroBiasSigma) +
                0.5 * states[0].accel_bias.squaredNorm() / (accel_bias_sigma * accel_bias_sigma) +
                0.5 * std::pow(time_offset_error_s / time_offset_sigma_s, 2);
  for (int i = 0; i + 1 < num_frames(); ++i) {
    const Eigen::Matrix<double, 9, 1> r =
        ComputeInertialResidual(imu_factors[i].measured, states[i], states[i + 1]).r.head<9>();
    cost += 0.5 * r.dot(imu_factors[i].information * r);
  }
  for (size_t i = 0; stamps_jitter() && i < stamps.size(); ++i) {
    cost += 0.5 * std::pow(stamps[i].error_s / stamp_sigma_s, 2);
  }
  const Cameras cameras = CamerasOf(*this);
  for (const StartPoint& point : points) {
    cost += PointCost(cameras, point, point.p_odom);
  }
  return cost;
}

std::vector<double> StartProblem::RayErrors() const {
  const Cameras cameras = CamerasOf(*this);
  std::vector<double> errors;
  for (const StartPoint& point : points) {
    for (const StartRay& seen : point.rays) {
      errors.push_back(RayError(cameras, seen, point.p_odom));
    }
  }
  return errors;
}

Equations StartProblem::Linearise(double damping) const {
  Equations out;
  out.cost = Cost();
  out.H.setZero(size(), size());
  out.g.setZero(size());
  out.H.diagonal().head<3>().setConstant(1 / (kGyroBiasSigma * kGyroBiasSigma));
  out.H.diagonal().segment<3>(3).setConstant(1 / (accel_bias_sigma * accel_bias_sigma));
  out.g.head<3>() = (states[0].gyro_bias - expected_gyro_bias) / (kGyroBiasSigma * kGyroBiasSigma);
  out.g.segment<3>(3) = states[0].accel_bias / (accel_bias_sigma * accel_bias_sigma);
  out.H.diagonal().segment<4>(PoseColumn(0) + 2).setConstant(1 / kHeld);
  for (int i = 0; i < static_cast<int>(imu_factors.size()); ++i) {
    AddImuFactor(*this, i, &out);
  }
  AddStamps(*this, &out);
  const Cameras cameras = CamerasOf(*this);
  for (const StartPoint& point : points) {
    out.eliminations.push_back(AddPoint(*this, cameras, point, damping, &out));
  }
  return out;
}

void StartProblem::Retract(const Equations& equations, const VectorXd& step) {
  for (int i = 0; i < num_frames(); ++i) {
    ImuState& state = states[i];
    Eigen::Matrix<double, 9, 1> at_stamp;
    at_stamp << step.segment<kPoseSize>(PoseColumn(i)), step.segment<3>(VelocityColumn(i));
    const double own_step_s = stamps_jitter() ? step[StampColumn(i)] : 0;
    at_stamp.segment<3>(kPosition) -= StampError(i) * at_stamp.segment<3>(kVelocity);
    at_stamp += ByStampError(*this, i) * (step[kTimeOffsetColumn] + own_step_s);
    stamps[i].error_s += own_step_s;
    const Eigen::Quaterniond rotation = ExpSo3(at_stamp.head<3>());
    state.T_odom_body.q = (rotation * state.T_odom_body.q).normalized();
    state.T_odom_body.t = rotation * state.T_odom_body.t + at_stamp.segment<3>(kPosition);
    state.v_odom_body = rotation * state.v_odom_body + at_stamp.segment<3>(kVelocity);
    state.gyro_bias += step.head<3>();
    state.accel_bias += step.segment<3>(3);
  }
  time_offset_error_s += step[kTimeOffsetColumn];
  const Cameras cameras = CamerasOf(*this);
  for (size_t i = 0; i < points.size(); ++i) {
    const auto& [first, offset, gain] = equations.eliminations[i];
    Settle(cameras, points[i].p_odom + offset + gain * step.segment(PoseColumn(first), gain.cols()),
           &points[i]);
  }
}

bool StartProblem::Optimise(int max_iterations) {
  const LevenbergMarquardtOptions options = {.max_iterations = max_iterations,
                                             .max_retries = kMaxRetries,
                                             .min_decrease = kEnough,
                                             .tolerance = 1e-9};
  const auto linearise = [](const StartProblem& problem, double damping) {
    return problem.Linearise(damping);
  };
  const auto solve = [](const StartProblem&, const Equations& equations) -> VectorXd {
    return SolveScaled(equations.H, equations.g);
  };
  const auto retract = [](const Equations& equations, const VectorXd& step, StartProblem* problem) {
    problem->Retract(equations, step);
  };
  const auto cost = [](const StartProblem& problem) { return problem.Cost(); };
  return LevenbergMarquardt(options, linearise, solve, retract, cost, this).converged;
}

std::optional<Matrix6d> StartProblem::NewestCovariance() const {
  const MatrixXd H = Linearise(0).H;
  const VectorXd scale = H.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::LLT<MatrixXd> llt(scale.asDiagonal() * H * scale.asDiagonal());
  if (llt.info() != Eigen::Success) {
    return std::nullopt;
  }
  const int newest = num_frames() - 1;
  // Jacobian of the newest frame's (dtheta, dv), dv = xi_v + dtheta x v.
  MatrixXd J = MatrixXd::Zero(size(), 6);
  J.block<3, 3>(PoseColumn(newest) + kTheta, 0).setIdentity();
  J.block<3, 3>(PoseColumn(newest) + kTheta, 3) = Hat(states[newest].v_odom_body);
  J.block<3, 3>(VelocityColumn(newest), 3).setIdentity();
  J.row(kTimeOffsetColumn).head<3>() = ByStampError(*this, newest).head<3>();
  if (stamps_jitter()) {
    J.row(StampColumn(newest)).head<3>() = J.row(kTimeOffsetColumn).head<3>();
  }
  const MatrixXd half = llt.matrixL().solve(scale.asDiagonal() * J);
  const Matrix6d covariance = half.transpose() * half;
  return covariance.allFinite() ? std::optional(covariance) : std::nullopt;
}

}  // namespace pangea::vio
