#include "loop_verification/joint_ba/hosted_point.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>

namespace pangea {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Matrix23 = Eigen::Matrix<double, 2, 3>;
using Matrix36 = Eigen::Matrix<double, 3, 6>;

constexpr double kMinDepth = 0.02;  // metres; a step that brings a point nearer is refused
constexpr double kMinInverseDepth = 1e-4;

Vector3d InWorld(const Vector3d& point, const PosedCamera& host) {
  return host.R_w_cam * (Vector3d(point.x(), point.y(), 1.0) / point.z()) + host.p_w_cam;
}

struct WhitenedSighting {
  Vector2d r;
  Matrix23 J;  // by the point's place in the world
};

std::optional<WhitenedSighting> Project(const HostedPoint::Sighting& sighting, const Vector3d& p_w,
                                        const PosedCamera& camera, bool with_jacobian) {
  const Vector3d p_cam = camera.R_w_cam.transpose() * (p_w - camera.p_w_cam);
  if (p_cam.z() < kMinDepth) {
    return std::nullopt;
  }
  const double inv_z = 1.0 / p_cam.z();
  const Vector2d xy = p_cam.head<2>() * inv_z;
  WhitenedSighting projection;
  projection.r = sighting.sqrt_info * (xy - sighting.ray);
  if (with_jacobian) {
    Matrix23 J_project;
    J_project << inv_z, 0, -xy.x() * inv_z, 0, inv_z, -xy.y() * inv_z;
    projection.J = sighting.sqrt_info * J_project * camera.R_w_cam.transpose();
  }
  return projection;
}

// How a point in the world moves with an error of a body's pose on which it hangs.
Matrix36 Moved(const Vector3d& p_w, const PosedCamera& camera) {
  Matrix36 A;
  A << Matrix3d::Identity(), -Hat(p_w - camera.p_w_body);
  return A;
}

using Matrix3N = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor>;

// Y = L^-1 Y. By rows: Eigen's solver is made for larger matrices, as is its product below.
void SolveLowerInPlace(const Matrix3d& L, Matrix3N* Y) {
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < i; ++j) {
      Y->row(i) -= L(i, j) * Y->row(j);
    }
    Y->row(i) *= 1 / L(i, i);
  }
}

// H - Y^T Y, from H's lower triangle.
void SubtractSquare(const Matrix3N& Y, Eigen::MatrixXd* H) {
  const Eigen::Index n = Y.cols();
  const double *y0 = Y.data(), *y1 = y0 + n, *y2 = y1 + n;
  for (Eigen::Index j = 0; j < n; ++j) {
    double* const column = H->data() + j * n;
    for (Eigen::Index i = j; i < n; ++i) {
      column[i] -= y0[i] * y0[j] + y1[i] * y1[j] + y2[i] * y2[j];
    }
    for (Eigen::Index i = 0; i < j; ++i) {
      column[i] = (*H)(j, i);
    }
  }
}

}  // namespace

double RobustLoss::Cost(double squared_residual) const {
  const double b = scale * scale;
  switch (kind) {
    case Kind::kHuber:
      return squared_residual <= b ? 0.5 * squared_residual
                                   : scale * std::sqrt(squared_residual) - 0.5 * b;
    case Kind::kCauchy:
      return 0.5 * b * std::log1p(squared_residual / b);
    default:
      return 0.5 * squared_residual;
  }
}

double RobustLoss::Weight(double squared_residual) const {
  const double b = scale * scale;
  switch (kind) {
    case Kind::kHuber:
      return squared_residual <= b ? 1 : scale / std::sqrt(squared_residual);
    case Kind::kCauchy:
      return 1 / (1 + squared_residual / b);
    default:
      return 1;
  }
}

PosedCamera::PosedCamera(const Rigid3& T_w_body, const Rigid3& T_body_cam)
    : p_w_body(T_w_body.t),
      p_w_cam(T_w_body * T_body_cam.t),
      R_w_cam((T_w_body.q * T_body_cam.q)) {}

std::optional<Vector2d> HostedPoint::Residual(const Sighting& sighting, const Vector3d& point,
                                              const std::vector<PosedCamera>& cameras) const {
  if (!(point.z() > kMinInverseDepth)) {
    return std::nullopt;
  }
  const auto projection =
      Project(sighting, InWorld(point, cameras[host]), cameras[sighting.frame], false);
  return projection ? std::make_optional(projection->r) : std::nullopt;
}

double HostedPoint::DepthResidual(const Vector3d& point, double kappa) const {
  return (point.z() - std::exp(-kappa) * inverse_depth) / inverse_depth_sigma;
}

double HostedPoint::Cost(const Vector3d& point, const std::vector<PosedCamera>& cameras,
                         double kappa, const RobustLoss& loss) const {
  constexpr double kBehind = std::numeric_limits<double>::infinity();
  if (!(point.z() > kMinInverseDepth)) {
    return kBehind;
  }
  const double depth = DepthResidual(point, kappa);
  double cost = 0.5 * ((sqrt_info * (point.head<2>() - ray)).squaredNorm() + depth * depth);
  const Vector3d p_w = InWorld(point, cameras[host]);
  for (const Sighting& sighting : seen) {
    const auto projection = Project(sighting, p_w, cameras[sighting.frame], false);
    if (!projection) {
      return kBehind;
    }
    cost += loss.Cost(projection->r.squaredNorm());
  }
  return cost;
}

Vector3d EliminatedPoint::Step(const Eigen::VectorXd& e) const {
  return -L.transpose().triangularView<Eigen::Upper>().solve(d + Y * e);
}

void Eliminate(const HostedPoint& hosted, const Vector3d& point,
               const std::vector<PosedCamera>& cameras, double kappa, const RobustLoss& loss,
               double damping, EliminatedPoint* eliminated) {
  const auto scale = static_cast<Eigen::Index>(6 * (1 + hosted.seen.size()));
  const PosedCamera& host = cameras[hosted.host];
  const Vector3d p_w = InWorld(point, host);
  Matrix3d M;  // of p_w by the point
  M << host.R_w_cam.leftCols<2>() / point.z(), -(p_w - host.p_w_cam) / point.z();
  const Matrix36 A_host = Moved(p_w, host);

  EliminatedPoint& out = *eliminated;
  out.H.setZero(scale + 1, scale + 1);
  out.g.setZero(scale + 1);
  auto& W = out.Y;  // of the point by e, until the point is eliminated
  W.setZero(3, scale + 1);
  Matrix3d N = Matrix3d::Zero();  // sum of J^T J, by p_w
  Vector3d n = Vector3d::Zero();
  for (size_t i = 0; i < hosted.seen.size(); ++i) {
    const HostedPoint::Sighting& sighting = hosted.seen[i];
    const PosedCamera& camera = cameras[sighting.frame];
    const WhitenedSighting projection = *Project(sighting, p_w, camera, true);
    const double weight = loss.Weight(projection.r.squaredNorm());
    const Matrix3d N_i = weight * projection.J.transpose() * projection.J;
    const Vector3d n_i = weight * projection.J.transpose() * projection.r;
    const Matrix36 A = Moved(p_w, camera);
    const Matrix36 NA = N_i * A;
    const auto at = static_cast<Eigen::Index>(6 * (1 + i));
    out.H.block<6, 6>(at, at) = A.transpose() * NA;
    out.H.block<6, 6>(at, 0) = -(NA.transpose() * A_host);
    out.g.segment<6>(at) = -A.transpose() * n_i;
    W.middleCols<6>(at) = -M.transpose() * NA;
    N += N_i;
    n += n_i;
  }
  out.H.topLeftCorner<6, 6>() = A_host.transpose() * N * A_host;
  out.g.head<6>() = A_host.transpose() * n;
  W.leftCols<6>() = M.transpose() * N * A_host;

  Matrix3d V = M.transpose() * N * M;
  Vector3d g_point = M.transpose() * n;
  V.topLeftCorner<2, 2>() += hosted.sqrt_info.transpose() * hosted.sqrt_info;
  g_point.head<2>() +=
      hosted.sqrt_info.transpose() * (hosted.sqrt_info * (point.head<2>() - hosted.ray));
  const double inverse_sigma = 1 / hosted.inverse_depth_sigma;
  const double by_scale = std::exp(-kappa) * hosted.inverse_depth * inverse_sigma;
  const double depth = hosted.DepthResidual(point, kappa);
  V(2, 2) += inverse_sigma * inverse_sigma;
  g_point.z() += inverse_sigma * depth;
  W.col(scale) = Vector3d(0, 0, inverse_sigma * by_scale);
  out.H(scale, scale) = by_scale * by_scale;
  out.g[scale] = by_scale * depth;

  V.diagonal() *= 1 + damping;
  out.L = V.llt().matrixL();
  SolveLowerInPlace(out.L, &out.Y);
  out.d = out.L.triangularView<Eigen::Lower>().solve(g_point);
  SubtractSquare(out.Y, &out.H);
  out.g -= out.Y.transpose() * out.d;
}

}  // namespace pangea
