#include "loop_verification/joint_ba/hosted_point.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

namespace pangea {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Matrix23 = Eigen::Matrix<double, 2, 3>;

constexpr double kMinDepth = 0.02;  // metres; a step that brings a point nearer is refused
constexpr double kMinInverseDepth = 1e-4;

Vector3d InWorld(const Vector3d& point, const PosedCamera& host) {
  return host.R_w_cam * (Vector3d(point.x(), point.y(), 1.0) / point.z()) + host.p_w_cam;
}

struct WhitenedObservation {
  Vector2d r;
  Matrix23 J;  // with respect to the point's position in w
};

std::optional<WhitenedObservation> Project(const HostedPoint::Observation& observation,
                                           const Vector3d& p_w, const PosedCamera& camera,
                                           bool with_jacobian) {
  const Vector3d p_cam = camera.R_w_cam.transpose() * (p_w - camera.p_w_cam);
  if (p_cam.z() < kMinDepth) {
    return std::nullopt;
  }
  const double inv_z = 1.0 / p_cam.z();
  const Vector2d xy = p_cam.head<2>() * inv_z;
  WhitenedObservation projection;
  projection.r = observation.sqrt_info * (xy - observation.ray);
  if (with_jacobian) {
    Matrix23 J_project;
    J_project << inv_z, 0, -xy.x() * inv_z, 0, inv_z, -xy.y() * inv_z;
    projection.J = observation.sqrt_info * J_project * camera.R_w_cam.transpose();
  }
  return projection;
}

// X [v]x
Matrix3d TimesHat(const Matrix3d& X, const Vector3d& v) {
  Matrix3d result;
  result << v.z() * X.col(1) - v.y() * X.col(2), v.x() * X.col(2) - v.z() * X.col(0),
      v.y() * X.col(0) - v.x() * X.col(1);
  return result;
}

// [v]x X
Matrix3d HatTimes(const Vector3d& v, const Matrix3d& X) {
  Matrix3d result;
  result << v.cross(X.col(0)), v.cross(X.col(1)), v.cross(X.col(2));
  return result;
}

// A_a^T C A_b with A = [I, -[arm]x].
Matrix6d Block(const Vector3d& arm_a, const Matrix3d& C, const Vector3d& arm_b) {
  const Matrix3d C_b = TimesHat(C, arm_b);
  Matrix6d block;
  block << C, -C_b, HatTimes(arm_a, C), -HatTimes(arm_a, C_b);
  return block;
}

// A^T v
Vector6d Moment(const Vector3d& arm, const Vector3d& v) {
  Vector6d moment;
  moment << v, arm.cross(v);
  return moment;
}

}  // namespace

PosedCamera::PosedCamera(const Rigid3& T_w_body, const Rigid3& T_body_cam)
    : p_w_body(T_w_body.t),
      p_w_cam(T_w_body * T_body_cam.t),
      R_w_cam((T_w_body.q * T_body_cam.q)) {}

std::optional<Vector2d> HostedPoint::Residual(const Observation& observation, const Vector3d& point,
                                              const std::vector<PosedCamera>& cameras) const {
  if (!(point.z() > kMinInverseDepth)) {
    return std::nullopt;
  }
  const auto projection =
      Project(observation, InWorld(point, cameras[host]), cameras[observation.frame], false);
  return projection ? std::make_optional(projection->r) : std::nullopt;
}

double HostedPoint::DepthResidual(const Vector3d& point, double kappa) const {
  return (point.z() - std::exp(-kappa) * inverse_depth) / inverse_depth_sigma;
}

double HostedPoint::PriorCost(const Vector3d& point, double depth_residual) const {
  return 0.5 *
         ((sqrt_info * (point.head<2>() - ray)).squaredNorm() + depth_residual * depth_residual);
}

double HostedPoint::Cost(const Vector3d& point, const std::vector<PosedCamera>& cameras,
                         double kappa, const RobustLoss& loss) const {
  constexpr double kBehind = std::numeric_limits<double>::infinity();
  if (!(point.z() > kMinInverseDepth)) {
    return kBehind;
  }
  double cost = PriorCost(point, DepthResidual(point, kappa));
  const Vector3d p_w = InWorld(point, cameras[host]);
  for (const Observation& observation : seen) {
    const auto projection = Project(observation, p_w, cameras[observation.frame], false);
    if (!projection) {
      return kBehind;
    }
    cost += loss.Cost(projection->r.squaredNorm());
  }
  return cost;
}

Matrix3d EliminatedPoint::Coupling(size_t a, size_t b) const {
  Matrix3d C = -(poses[a].U.transpose() * poses[b].U);
  if (a == b) {
    C += poses[a].N;
  } else if (a == 0 || b == 0) {
    C -= poses[std::max(a, b)].N;  // the host displaces the point, an observing frame its camera
  }
  return C;
}

void EliminatedPoint::AddTo(const std::vector<int>& columns, Eigen::MatrixXd* H,
                            Eigen::VectorXd* g) const {
  const int scale = columns.back();
  for (size_t a = 0; a < poses.size(); ++a) {
    if (columns[a] >= H->cols()) {
      continue;
    }
    for (size_t b = 0; b < poses.size(); ++b) {
      if (columns[b] <= columns[a]) {
        H->block<6, 6>(columns[a], columns[b]) += Block(poses[a].arm, Coupling(a, b), poses[b].arm);
      }
    }
    const Vector6d with_scale = -Moment(poses[a].arm, poses[a].U.transpose() * u_scale);
    if (columns[a] > scale) {
      H->block<6, 1>(columns[a], scale) += with_scale;
    } else {
      H->block<1, 6>(scale, columns[a]) += with_scale.transpose();
    }
    g->segment<6>(columns[a]) += Moment(poses[a].arm, poses[a].g - poses[a].U.transpose() * d);
  }
  (*H)(scale, scale) += h_scale - u_scale.squaredNorm();
  (*g)[scale] += g_scale - u_scale.dot(d);
}

Eigen::MatrixXd EliminatedPoint::Information() const {
  std::vector<int> columns;
  for (size_t i = 0; i <= poses.size(); ++i) {
    columns.push_back(static_cast<int>(6 * i));
  }
  const Eigen::Index size = columns.back() + 1;
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(size, size);
  Eigen::VectorXd g = Eigen::VectorXd::Zero(size);
  AddTo(columns, &H, &g);
  H.triangularView<Eigen::StrictlyUpper>() = H.transpose();
  return H;
}

Vector3d EliminatedPoint::Step(const std::vector<int>& columns, const Eigen::VectorXd& step) const {
  Vector3d moved = d + u_scale * step[columns.back()];
  for (size_t i = 0; i < poses.size(); ++i) {
    if (columns[i] < step.size()) {
      const Vector3d rotation = step.segment<3>(columns[i] + 3);
      moved += poses[i].U * (step.segment<3>(columns[i]) - poses[i].arm.cross(rotation));
    }
  }
  return -L.transpose().triangularView<Eigen::Upper>().solve(moved);
}

void Eliminate(const HostedPoint& hosted, const Vector3d& point,
               const std::vector<PosedCamera>& cameras, double kappa, const RobustLoss& loss,
               double damping, EliminatedPoint* eliminated) {
  const PosedCamera& host = cameras[hosted.host];
  const Vector3d p_w = InWorld(point, host);
  Matrix3d M;  // d(p_w)/d(point)
  M << host.R_w_cam.leftCols<2>() / point.z(), -(p_w - host.p_w_cam) / point.z();

  EliminatedPoint& out = *eliminated;
  out.poses.resize(1 + hosted.seen.size());
  EliminatedPoint::Pose& of_host = out.poses[0];
  of_host.arm = p_w - host.p_w_body;
  of_host.N.setZero();  // sum of J^T J, J with respect to p_w
  of_host.g.setZero();
  const double depth = hosted.DepthResidual(point, kappa);
  out.cost = hosted.PriorCost(point, depth);
  for (size_t i = 0; i < hosted.seen.size(); ++i) {
    const HostedPoint::Observation& observation = hosted.seen[i];
    const PosedCamera& camera = cameras[observation.frame];
    const WhitenedObservation projection = *Project(observation, p_w, camera, true);
    const double squared = projection.r.squaredNorm();
    out.cost += loss.Cost(squared);
    const double weight = loss.Weight(squared);
    EliminatedPoint::Pose& pose = out.poses[1 + i];
    pose.arm = p_w - camera.p_w_body;
    pose.N = weight * projection.J.transpose() * projection.J;
    pose.g = -weight * projection.J.transpose() * projection.r;
    of_host.N += pose.N;
    of_host.g -= pose.g;
  }

  Matrix3d V = M.transpose() * of_host.N * M;
  Vector3d g_point = M.transpose() * of_host.g;
  V.topLeftCorner<2, 2>() += hosted.sqrt_info.transpose() * hosted.sqrt_info;
  g_point.head<2>() +=
      hosted.sqrt_info.transpose() * (hosted.sqrt_info * (point.head<2>() - hosted.ray));
  const double inverse_sigma = 1 / hosted.inverse_depth_sigma;
  const double by_scale = std::exp(-kappa) * hosted.inverse_depth * inverse_sigma;
  V(2, 2) += inverse_sigma * inverse_sigma;
  g_point.z() += inverse_sigma * depth;
  V.diagonal() *= 1 + damping;

  out.L = V.llt().matrixL();
  const auto L = out.L.triangularView<Eigen::Lower>();
  out.d = L.solve(g_point);
  const Matrix3d L_inverse_M = L.solve(Matrix3d(M.transpose()));
  of_host.U = L_inverse_M * of_host.N;
  for (size_t i = 1; i < out.poses.size(); ++i) {
    out.poses[i].U = -(L_inverse_M * out.poses[i].N);
  }
  out.u_scale = L.solve(Vector3d(0, 0, inverse_sigma * by_scale));
  out.h_scale = by_scale * by_scale;
  out.g_scale = by_scale * depth;
}

}  // namespace pangea
