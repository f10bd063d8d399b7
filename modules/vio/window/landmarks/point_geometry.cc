#include "vio/window/landmarks/point_geometry.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <vector>

#include "core/numerics/triangulation.h"

namespace pangea::vio {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kMinDepth = 0.1;  // metres, in any camera that sees the point
constexpr double kMaxDepth = 200;  // metres; farther points get no depth from a phone's baseline
// Largest sigma of the inverse depth: relative to itself, or absolute (then the point is "far").
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

Rigid3 BodyPose(const WindowState& state, const FrameRay& seen) {
  return state.PoseAhead(seen.frame, state.Ahead(seen.frame, seen.row_s));
}

Rigid3 CameraPose(const WindowState& state, const FrameRay& seen) {
  return BodyPose(state, seen) * state.T_body_cam;
}

// Lines of sight in the odom frame.
std::vector<LineOfSight> LinesOfSight(const WindowState& state, std::span<const FrameRay> rays,
                                      const std::vector<Rigid3>& T_odom_cam) {
  std::vector<LineOfSight> lines;
  lines.reserve(rays.size());
  for (size_t i = 0; i < rays.size(); ++i) {
    lines.push_back(
        {T_odom_cam[i].t, (T_odom_cam[i].q * rays[i].RayBy(state).homogeneous()).normalized()});
  }
  return lines;
}

// Normal equations of a Gauss-Newton step for a point (alpha, beta, rho) seen along `rays`.
struct PointNormalEquations {
  Matrix3d A = Matrix3d::Zero();
  Vector3d b = Vector3d::Zero();
  double cost = 0;
};

// Returns nothing if the point is behind a camera.
std::optional<PointNormalEquations> PointEquations(const WindowState& state,
                                                   std::span<const FrameRay> rays,
                                                   const std::vector<Rigid3>& T_odom_cam,
                                                   size_t anchor, const AnchoredPoint& point) {
  const Matrix3d R_odom_anchor = T_odom_cam[anchor].R();
  const Vector3d x_odom = R_odom_anchor * point.InCamera() + T_odom_cam[anchor].t;
  const Matrix3d odom_by_point = R_odom_anchor * PointJacobian(point.ray_rho);
  PointNormalEquations equations;
  for (size_t i = 0; i < rays.size(); ++i) {
    const Matrix3d R_cam_odom = T_odom_cam[i].R().transpose();
    const Vector3d y = R_cam_odom * (x_odom - T_odom_cam[i].t);
    if (!(y.z() > kMinDepth)) {
      return std::nullopt;
    }
    const Vector2d r = (rays[i].RayBy(state) - y.head<2>() / y.z()) / rays[i].sigma;
    const Eigen::Matrix<double, 2, 3> J =
        RayJacobian(y) * R_cam_odom * odom_by_point / rays[i].sigma;
    equations.A += J.transpose() * J;
    equations.b += J.transpose() * r;
    equations.cost += r.squaredNorm();
  }
  return equations;
}

bool HasDepth(const Triangulated& point) {
  const double rho = point.point.ray_rho.z();
  const double sigma_rho = std::sqrt(point.covariance(2, 2));
  return 1 / rho <= kMaxDepth && 1 / rho >= kMinDepth &&
         (sigma_rho < kMaxRelativeSigma * rho || sigma_rho < kMaxInverseDepthSigma);
}

}  // namespace

const RowView& RowViews::At(int frame, double row_s) {
  std::optional<RowView>& view = last_[frame];
  if (!view || view->row_s != row_s) {
    view.emplace();
    view->row_s = row_s;
    view->ahead_s = state_->Ahead(frame, row_s);
    view->T_odom_body = state_->PoseAhead(frame, view->ahead_s);
    view->R_odom_body = view->T_odom_body.R();
  }
  return *view;
}

Vector3d RowViews::CarriedBy(int frame, double row_s, const Vector3d& p_odom) {
  At(frame, row_s);
  RowView& view = *last_[frame];
  if (!view.omega_odom) {
    const WindowFrame& f = state_->frames[frame];
    const double ahead_s = view.ahead_s;
    const Vector3d rotation = ahead_s * f.omega_body + 0.5 * ahead_s * ahead_s * f.alpha_body;
    view.omega_odom =
        view.R_odom_body * (RightJacobian(rotation) * (f.omega_body + ahead_s * f.alpha_body));
    view.v_odom = f.imu.v_odom_body + ahead_s * (f.imu.T_odom_body.q * f.a_body);
  }
  return *view.v_odom + view.omega_odom->cross(p_odom - view.T_odom_body.t);
}

PointInOdom::PointInOdom(RowViews& rows, const AnchoredPoint& point) {
  const WindowState& state = rows.state();
  const RowView& anchor = rows.At(point.anchor, point.anchor_row_s);
  const Vector3d x_body = state.T_body_cam.q * point.InCamera();
  by_translation = anchor.R_odom_body;
  p_odom = by_translation * (x_body + state.T_body_cam.t) + anchor.T_odom_body.t;
  by_rotation = by_translation * Hat(-x_body);
  by_point = by_translation * state.T_body_cam.R() * PointJacobian(point.ray_rho);
  by_anchor_stamp = rows.CarriedBy(point.anchor, point.anchor_row_s, p_odom);
  anchor_excess_interval_s = state.frames[point.anchor].excess_interval_s;
}

Vector3d InOdom(RowViews& rows, const AnchoredPoint& point) {
  const RowView& anchor = rows.At(point.anchor, point.anchor_row_s);
  return anchor.R_odom_body * (rows.state().T_body_cam * point.InCamera()) + anchor.T_odom_body.t;
}

std::optional<Vector2d> PredictRayOnly(RowViews& rows, const Vector3d& p_odom,
                                       const FrameRay& seen) {
  const WindowState& state = rows.state();
  const RowView& view = rows.At(seen.frame, seen.row_s);
  const Vector3d y_body =
      view.R_odom_body.transpose() * (p_odom - view.T_odom_body.t) - state.T_body_cam.t;
  const Vector3d y = state.T_body_cam.q.conjugate() * y_body;
  if (!(y.z() > kMinDepth)) {
    return std::nullopt;
  }
  return seen.AsGiven(state, y.head<2>() / y.z());
}

std::optional<PredictedRay> PredictRay(RowViews& rows, const PointInOdom& point,
                                       const FrameRay& seen) {
  const WindowState& state = rows.state();
  const RowView& view = rows.At(seen.frame, seen.row_s);
  const Matrix3d R_body_odom = view.R_odom_body.transpose();
  const Matrix3d R_cam_body = state.T_body_cam.R().transpose();
  const Vector3d y_body = R_body_odom * (point.p_odom - view.T_odom_body.t) - state.T_body_cam.t;
  const Vector3d y = R_cam_body * y_body;
  if (!(y.z() > kMinDepth)) {
    return std::nullopt;
  }
  // Derivatives of the ray with respect to a shift of the point, in the axes of body and of odom.
  const Eigen::Matrix<double, 2, 3> J_body =
      (1 + state.intrinsics.x()) * RayJacobian(y) * R_cam_body;
  const Eigen::Matrix<double, 2, 3> J_odom = J_body * R_body_odom;

  PredictedRay out;
  const Vector2d ray = y.head<2>() / y.z();
  out.ray = seen.AsGiven(state, ray);
  out.J_frame << J_odom * Hat(point.p_odom), -J_odom;
  out.J_anchor = -out.J_frame;
  out.J_calibration.leftCols<3>() = J_body * Hat(y_body) + J_odom * point.by_rotation;
  out.J_calibration.middleCols<3>(3) = J_odom * point.by_translation - J_body;
  out.J_frame_stamp = -(J_odom * rows.CarriedBy(seen.frame, seen.row_s, point.p_odom));
  out.J_anchor_stamp = J_odom * point.by_anchor_stamp;
  out.J_calibration.col(kTimeOffset) = out.J_frame_stamp + out.J_anchor_stamp;
  out.J_calibration.middleCols<kIntrinsicsSize>(kIntrinsics) = -seen.J_intrinsics;
  out.J_calibration.col(kIntrinsics) += ray - seen.ray;
  out.J_calibration.col(kIntervalShare) =
      state.frames[seen.frame].excess_interval_s * out.J_frame_stamp +
      point.anchor_excess_interval_s * out.J_anchor_stamp;
  out.J_point = J_odom * point.by_point;
  return out;
}

std::optional<Triangulated> Triangulate(const WindowState& state, std::span<const FrameRay> rays,
                                        size_t anchor) {
  std::vector<Rigid3> T_odom_cam;
  T_odom_cam.reserve(rays.size());
  for (const FrameRay& seen : rays) {
    T_odom_cam.push_back(CameraPose(state, seen));
  }
  const auto p_odom = TriangulateMidpoint(LinesOfSight(state, rays, T_odom_cam));
  if (!p_odom) {
    return std::nullopt;
  }
  const Vector3d p_anchor = T_odom_cam[anchor].Inverse() * *p_odom;
  if (!(p_anchor.z() > kMinDepth)) {
    return std::nullopt;
  }
  Triangulated out;
  out.point.anchor = rays[anchor].frame;
  out.point.anchor_row_s = rays[anchor].row_s;
  out.point.ray_rho = {p_anchor.x() / p_anchor.z(), p_anchor.y() / p_anchor.z(), 1 / p_anchor.z()};
  double cost = 0, last_cost = 1e300;
  for (int iteration = 0; iteration < 10; ++iteration) {
    const auto equations = PointEquations(state, rays, T_odom_cam, anchor, out.point);
    if (!equations) {
      return std::nullopt;
    }
    cost = equations->cost;
    const Eigen::LDLT<Matrix3d> ldlt(equations->A);
    const Vector3d step = ldlt.solve(equations->b);
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
  if (!HasDepth(out)) {
    return std::nullopt;
  }
  out.rms = std::sqrt(cost / (2.0 * static_cast<double>(rays.size())));
  return out;
}

}  // namespace pangea::vio
