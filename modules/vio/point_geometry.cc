#include "vio/point_geometry.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <cmath>

namespace pangea::vio {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kMinDepth = 0.1;  // metres, in any camera that sees the point
constexpr double kMaxDepth = 200;  // beyond it a phone's baseline says nothing
// The inverse depth must be known to this share of itself or to this much absolutely (then the
// point is "far").
constexpr double kMaxRelativeSigma = 0.5;
constexpr double kMaxInverseDepthSigma = 0.02;

// d(x_cam)/d(alpha, beta, rho) for x_cam = (alpha, beta, 1) / rho.
Matrix3d PointJacobian(const Vector3d& f) {
  const double depth = 1.0 / f.z();
  Matrix3d J;
  J << depth, 0, -f.x() * depth * depth, 0, depth, -f.y() * depth * depth, 0, 0, -depth * depth;
  return J;
}

// A point of the anchor's camera seen in clone c's camera, with derivatives (docs/maths_vio.md).
struct Transfer {
  Vector3d y_cam;  // in clone c's camera
  // d(y_cam)/d(anchor dtheta, xi), (clone dtheta, xi), (extrinsics dtheta, dp), (alpha, beta, rho)
  Eigen::Matrix<double, 3, 6> J_anchor, J_clone, J_extrinsics;
  Matrix3d J_point;
};

Transfer TransferPoint(const WindowState& state, const AnchoredPoint& point, int anchor,
                       int clone) {
  const Rigid3& T_a = state.clones[anchor].T_odom_body;
  const Rigid3& T_c = state.clones[clone].T_odom_body;
  const Rigid3& T_bc = state.T_body_cam;
  const Vector3d x_cam = point.InCamera();
  const Vector3d p_odom = T_a * (T_bc * x_cam);
  const Vector3d y_body = T_c.Inverse() * p_odom;
  const Matrix3d R_cam_odom = (T_c.q * T_bc.q).conjugate().toRotationMatrix();
  const Matrix3d R_cam_body = T_bc.q.conjugate().toRotationMatrix();
  const Matrix3d R_body_anchor = (T_c.q.conjugate() * T_a.q).toRotationMatrix();
  Transfer t;
  t.y_cam = R_cam_body * (y_body - T_bc.t);
  const Matrix3d turn = R_cam_odom * Hat(p_odom);
  t.J_clone << turn, -R_cam_odom;
  t.J_anchor << -turn, R_cam_odom;
  t.J_extrinsics << R_cam_body * (Hat(y_body - T_bc.t) - R_body_anchor * Hat(T_bc.q * x_cam)),
      R_cam_body * (R_body_anchor - Matrix3d::Identity());
  t.J_point = R_cam_body * R_body_anchor * T_bc.R() * PointJacobian(point.ray_rho);
  return t;
}

Eigen::Matrix<double, 2, 3> RayJacobian(const Vector3d& y) {
  const double inv = 1.0 / y.z();
  Eigen::Matrix<double, 2, 3> J;
  J << inv, 0, -y.x() * inv * inv, 0, inv, -y.y() * inv * inv;
  return J;
}

// Where the rays meet, linear: minimises the distance to all of them. In odom.
std::optional<Vector3d> MeetRays(const WindowState& state, std::span<const ClonedRay> rays) {
  Matrix3d A = Matrix3d::Zero();
  Vector3d b = Vector3d::Zero();
  for (const ClonedRay& seen : rays) {
    const Rigid3 T_odom_cam = state.clones[seen.clone].T_odom_body * state.T_body_cam;
    const Vector3d d = (T_odom_cam.q * Vector3d(seen.ray.x(), seen.ray.y(), 1)).normalized();
    const Matrix3d across = Matrix3d::Identity() - d * d.transpose();
    A += across;
    b += across * T_odom_cam.t;
  }
  const Eigen::LDLT<Matrix3d> ldlt(A);
  if (ldlt.info() != Eigen::Success || ldlt.vectorD().minCoeff() < 1e-9) {
    return std::nullopt;
  }
  return Vector3d(ldlt.solve(b));
}

}  // namespace

std::optional<PredictedRay> PredictRay(const WindowState& state, const AnchoredPoint& point,
                                       int clone, bool with_derivatives) {
  const int anchor = state.CloneIndex(point.anchor_utime);
  const Transfer t = TransferPoint(state, point, anchor, clone);
  if (!(t.y_cam.z() > kMinDepth)) {
    return std::nullopt;
  }
  PredictedRay out;
  out.ray = t.y_cam.head<2>() / t.y_cam.z();
  if (with_derivatives) {
    const Eigen::Matrix<double, 2, 3> J = RayJacobian(t.y_cam);
    out.H_x.setZero(2, state.size());
    // In its own anchor the two pose blocks cancel; the sum is right in every case.
    out.H_x.middleCols<6>(state.CloneOffset(clone)) += J * t.J_clone;
    out.H_x.middleCols<6>(state.CloneOffset(anchor)) += J * t.J_anchor;
    out.H_x.middleCols<6>(kExtrinsics) += J * t.J_extrinsics;
    out.H_f = J * t.J_point;
  }
  return out;
}

std::optional<Triangulated> Triangulate(const WindowState& state, std::span<const ClonedRay> rays,
                                        int anchor_clone) {
  const auto p_odom = MeetRays(state, rays);
  if (!p_odom) {
    return std::nullopt;
  }
  const Rigid3 T_odom_anchor = state.clones[anchor_clone].T_odom_body * state.T_body_cam;
  const Vector3d p_anchor = T_odom_anchor.Inverse() * *p_odom;
  Triangulated out;
  out.point.anchor_utime = state.clones[anchor_clone].utime;
  const double depth = p_anchor.z() > kMinDepth ? p_anchor.z() : kMaxDepth;  // parallel rays: far
  out.point.ray_rho = {p_anchor.x() / p_anchor.z(), p_anchor.y() / p_anchor.z(), 1 / depth};
  if (!(p_anchor.z() > kMinDepth)) {
    return std::nullopt;
  }
  double cost = 0, last_cost = 1e300;
  for (int iteration = 0; iteration < 10; ++iteration) {
    Matrix3d A = Matrix3d::Zero();
    Vector3d b = Vector3d::Zero();
    cost = 0;
    for (const ClonedRay& seen : rays) {
      const Transfer t = TransferPoint(state, out.point, anchor_clone, seen.clone);
      if (!(t.y_cam.z() > kMinDepth)) {
        return std::nullopt;
      }
      const Vector2d r = (seen.ray - t.y_cam.head<2>() / t.y_cam.z()) / seen.sigma;
      const Eigen::Matrix<double, 2, 3> J = RayJacobian(t.y_cam) * t.J_point / seen.sigma;
      A += J.transpose() * J;
      b += J.transpose() * r;
      cost += r.squaredNorm();
    }
    const Eigen::LDLT<Matrix3d> ldlt(A);
    const Vector3d step = ldlt.solve(b);
    if (!step.allFinite()) {
      return std::nullopt;
    }
    out.point.ray_rho += step;
    out.covariance = ldlt.solve(Matrix3d::Identity());
    if (out.point.ray_rho.z() < 1e-4) {
      return std::nullopt;
    }
    if (std::abs(last_cost - cost) < 1e-4 * (1 + cost)) {
      break;
    }
    last_cost = cost;
  }
  const double rho = out.point.ray_rho.z();
  const double sigma_rho = std::sqrt(out.covariance(2, 2));
  if (1 / rho > kMaxDepth || 1 / rho < kMinDepth ||
      !(sigma_rho < kMaxRelativeSigma * rho || sigma_rho < kMaxInverseDepthSigma)) {
    return std::nullopt;
  }
  out.rms = std::sqrt(cost / (2.0 * static_cast<double>(rays.size())));
  return out;
}

std::optional<PointMeasurement> MeasurePoint(const WindowState& state, const AnchoredPoint& point,
                                             std::span<const ClonedRay> rays) {
  const int rows = 2 * static_cast<int>(rays.size());
  PointMeasurement m;
  m.x.H.resize(rows, state.size());
  m.x.r.resize(rows);
  m.H_f.resize(rows, 3);
  for (int i = 0; i < static_cast<int>(rays.size()); ++i) {
    const ClonedRay& seen = rays[i];
    const auto predicted = PredictRay(state, point, seen.clone, true);
    if (!predicted) {
      return std::nullopt;
    }
    m.x.H.middleRows<2>(2 * i) = predicted->H_x / seen.sigma;
    m.H_f.middleRows<2>(2 * i) = predicted->H_f / seen.sigma;
    m.x.r.segment<2>(2 * i) = (seen.ray - predicted->ray) / seen.sigma;
  }
  return m;
}

Measurement WithoutPoint(const PointMeasurement& m) {
  const Eigen::HouseholderQR<MatrixXd> qr(m.H_f);
  MatrixXd H = m.x.H;
  VectorXd r = m.x.r;
  H.applyOnTheLeft(qr.householderQ().adjoint());
  r.applyOnTheLeft(qr.householderQ().adjoint());
  const int rest = static_cast<int>(H.rows()) - 3;
  return {H.bottomRows(rest), r.tail(rest)};
}

std::optional<Reanchored> Reanchor(const WindowState& state, int landmark, int new_anchor_clone) {
  const AnchoredPoint& old_point = state.landmarks[landmark].second;
  const int old_anchor = state.CloneIndex(old_point.anchor_utime);
  const Transfer t = TransferPoint(state, old_point, old_anchor, new_anchor_clone);
  if (!(t.y_cam.z() > kMinDepth)) {
    return std::nullopt;
  }
  const double rho = 1 / t.y_cam.z();
  Reanchored out;
  out.point.anchor_utime = state.clones[new_anchor_clone].utime;
  out.point.ray_rho = {t.y_cam.x() * rho, t.y_cam.y() * rho, rho};
  // The inverse of PointJacobian at the new place.
  const Matrix3d J = PointJacobian(out.point.ray_rho).inverse();
  out.J = MatrixXd::Zero(3, state.size());
  out.J.middleCols<6>(state.CloneOffset(new_anchor_clone)) += J * t.J_clone;
  out.J.middleCols<6>(state.CloneOffset(old_anchor)) += J * t.J_anchor;
  out.J.middleCols<6>(kExtrinsics) += J * t.J_extrinsics;
  out.J.middleCols<3>(state.LandmarkOffset(landmark)) += J * t.J_point;
  return out;
}

}  // namespace pangea::vio
