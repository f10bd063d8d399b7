#include "vio/window/point_geometry.h"

#include <Eigen/Cholesky>
#include <cmath>

namespace pangea::vio {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

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

Eigen::Matrix<double, 2, 3> RayJacobian(const Vector3d& y) {
  const double inv = 1.0 / y.z();
  Eigen::Matrix<double, 2, 3> J;
  J << inv, 0, -y.x() * inv * inv, 0, inv, -y.y() * inv * inv;
  return J;
}

// The error (dtheta, xi) of a frame's pose that a second more of its motion makes.
Eigen::Matrix<double, kPoseSize, 1> Motion(const WindowFrame& frame, const Rigid3& T_odom_body) {
  const Vector3d omega_odom = T_odom_body.q * frame.omega_body;
  Eigen::Matrix<double, kPoseSize, 1> motion;
  motion << omega_odom, frame.imu.v_odom_body + T_odom_body.t.cross(omega_odom);
  return motion;
}

// A point of the anchor's camera in the camera of another frame.
Vector3d InOther(const WindowState& state, const AnchoredPoint& point, const FrameRay& seen) {
  const Rigid3 T_a = state.PoseAhead(point.anchor, state.Ahead(point.anchor, point.anchor_row_s));
  const Rigid3 T_c = state.PoseAhead(seen.frame, state.Ahead(seen.frame, seen.row_s));
  return (T_c * state.T_body_cam).Inverse() * (T_a * (state.T_body_cam * point.InCamera()));
}

Rigid3 CameraPose(const WindowState& state, const FrameRay& seen) {
  return state.PoseAhead(seen.frame, state.Ahead(seen.frame, seen.row_s)) * state.T_body_cam;
}

// Where the rays meet, linear: minimises the distance to all of them. In odom.
std::optional<Vector3d> MeetRays(const WindowState& state, std::span<const FrameRay> rays) {
  Matrix3d A = Matrix3d::Zero();
  Vector3d b = Vector3d::Zero();
  for (const FrameRay& seen : rays) {
    const Rigid3 T_odom_cam = CameraPose(state, seen);
    const Vector2d ray = seen.RayBy(state);
    const Vector3d d = (T_odom_cam.q * Vector3d(ray.x(), ray.y(), 1)).normalized();
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

std::optional<Vector2d> PredictRayOnly(const WindowState& state, const AnchoredPoint& point,
                                       const FrameRay& seen) {
  const Vector3d y = InOther(state, point, seen);
  if (!(y.z() > kMinDepth)) {
    return std::nullopt;
  }
  return seen.AsGiven(state, y.head<2>() / y.z());
}

std::optional<PredictedRay> PredictRay(const WindowState& state, const AnchoredPoint& point,
                                       const FrameRay& seen) {
  const WindowFrame& anchor = state.frames[point.anchor];
  const WindowFrame& frame = state.frames[seen.frame];
  const Rigid3 T_a = state.PoseAhead(point.anchor, state.Ahead(point.anchor, point.anchor_row_s));
  const Rigid3 T_c = state.PoseAhead(seen.frame, state.Ahead(seen.frame, seen.row_s));
  const Rigid3& T_bc = state.T_body_cam;
  const Vector3d x_cam = point.InCamera();
  const Vector3d p_odom = T_a * (T_bc * x_cam);
  const Vector3d y_body = T_c.Inverse() * p_odom;
  const Matrix3d R_cam_body = T_bc.q.conjugate().toRotationMatrix();
  const Vector3d y = R_cam_body * (y_body - T_bc.t);
  if (!(y.z() > kMinDepth)) {
    return std::nullopt;
  }
  const Matrix3d R_cam_odom = R_cam_body * T_c.R().transpose();
  const Matrix3d R_body_anchor = (T_c.q.conjugate() * T_a.q).toRotationMatrix();
  const Eigen::Matrix<double, 2, 3> J = (1 + state.intrinsics.x()) * RayJacobian(y);
  const Eigen::Matrix<double, 2, 3> J_odom = J * R_cam_odom;

  PredictedRay out;
  const Vector2d ray = y.head<2>() / y.z();
  out.ray = seen.AsGiven(state, ray);
  out.J_frame << J_odom * Hat(p_odom), -J_odom;
  out.J_anchor = -out.J_frame;
  out.J_calibration.leftCols<3>() =
      J * R_cam_body * (Hat(y_body - T_bc.t) - R_body_anchor * Hat(T_bc.q * x_cam));
  out.J_calibration.middleCols<3>(3) = J * R_cam_body * (R_body_anchor - Matrix3d::Identity());
  out.J_frame_stamp = out.J_frame * Motion(frame, T_c);
  out.J_anchor_stamp = out.J_anchor * Motion(anchor, T_a);
  out.J_calibration.col(kTimeOffset) = out.J_frame_stamp + out.J_anchor_stamp;
  out.J_calibration.middleCols<3>(kIntrinsics) = -seen.J_intrinsics;
  out.J_calibration.col(kIntrinsics) += ray - seen.ray;
  out.J_point = J * R_cam_body * R_body_anchor * T_bc.R() * PointJacobian(point.ray_rho);
  return out;
}

std::optional<Triangulated> Triangulate(const WindowState& state, std::span<const FrameRay> rays,
                                        size_t anchor) {
  const auto p_odom = MeetRays(state, rays);
  if (!p_odom) {
    return std::nullopt;
  }
  const Vector3d p_anchor = CameraPose(state, rays[anchor]).Inverse() * *p_odom;
  if (!(p_anchor.z() > kMinDepth)) {
    return std::nullopt;
  }
  Triangulated out;
  out.point.anchor = rays[anchor].frame;
  out.point.anchor_row_s = rays[anchor].row_s;
  out.point.ray_rho = {p_anchor.x() / p_anchor.z(), p_anchor.y() / p_anchor.z(), 1 / p_anchor.z()};
  const Matrix3d R_odom_anchor = CameraPose(state, rays[anchor]).R();
  double cost = 0, last_cost = 1e300;
  for (int iteration = 0; iteration < 10; ++iteration) {
    Matrix3d A = Matrix3d::Zero();
    Vector3d b = Vector3d::Zero();
    cost = 0;
    for (const FrameRay& seen : rays) {
      const Vector3d y = InOther(state, out.point, seen);
      if (!(y.z() > kMinDepth)) {
        return std::nullopt;
      }
      const Vector2d r = (seen.RayBy(state) - y.head<2>() / y.z()) / seen.sigma;
      const Eigen::Matrix<double, 2, 3> J =
          RayJacobian(y) * CameraPose(state, seen).R().transpose() * R_odom_anchor *
          PointJacobian(out.point.ray_rho) / seen.sigma;
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

}  // namespace pangea::vio
