#include "core/camera_model.h"

#include <fmt/format.h>

#include <cmath>

#include "core/numerics/elementary.h"

namespace pangea {
namespace {

using Matrix2d = Eigen::Matrix2d;
using Vector2d = Eigen::Vector2d;

// Distorts a point of the plane z = 1. J = d(distorted)/d(xy).
Vector2d DistortRadtan(const Eigen::Vector4d& k, const Vector2d& xy, Matrix2d* J) {
  const double x = xy.x(), y = xy.y();
  const double r2 = x * x + y * y;
  const double radial = 1 + r2 * (k[0] + r2 * k[1]);
  const double dradial = k[0] + 2 * r2 * k[1];  // d(radial)/d(r2)
  if (J != nullptr) {
    *J << radial + 2 * x * x * dradial + 2 * k[2] * y + 6 * k[3] * x,
        2 * x * y * dradial + 2 * k[2] * x + 2 * k[3] * y,
        2 * x * y * dradial + 2 * k[2] * x + 2 * k[3] * y,
        radial + 2 * y * y * dradial + 6 * k[2] * y + 2 * k[3] * x;
  }
  return {x * radial + 2 * k[2] * x * y + k[3] * (r2 + 2 * x * x),
          y * radial + k[2] * (r2 + 2 * y * y) + 2 * k[3] * x * y};
}

Vector2d DistortEquidistant(const Eigen::Vector4d& k, const Vector2d& xy, Matrix2d* J) {
  const double r = xy.norm();
  if (r < 1e-9) {
    if (J != nullptr) {
      J->setIdentity();
    }
    return xy;
  }
  const double theta = Atan(r);
  const double t2 = theta * theta;
  const double theta_d = theta * (1 + t2 * (k[0] + t2 * (k[1] + t2 * (k[2] + t2 * k[3]))));
  const double s = theta_d / r;
  if (J != nullptr) {
    const double dtheta_d = 1 + t2 * (3 * k[0] + t2 * (5 * k[1] + t2 * (7 * k[2] + t2 * 9 * k[3])));
    const double ds = (dtheta_d / (1 + r * r) - s) / r;  // d(s)/d(r)
    *J = s * Matrix2d::Identity() + ds / r * xy * xy.transpose();
  }
  return s * xy;
}

Vector2d Distort(CameraModel::Kind kind, const Eigen::Vector4d& k, const Vector2d& xy,
                 Matrix2d* J) {
  return kind == CameraModel::Kind::kRadtan ? DistortRadtan(k, xy, J)
                                            : DistortEquidistant(k, xy, J);
}

// Newton's method from the distorted point; three or four steps inside the image.
std::optional<Vector2d> UndistortRadtan(const Eigen::Vector4d& k, const Vector2d& target) {
  Vector2d xy = target;
  for (int i = 0; i < 20; ++i) {
    Matrix2d J;
    const Vector2d error = DistortRadtan(k, xy, &J) - target;
    if (!(J.determinant() > 1e-12) || !xy.allFinite()) {
      return std::nullopt;
    }
    if (error.squaredNorm() < 1e-24) {
      return xy;
    }
    xy -= J.inverse() * error;
  }
  return std::nullopt;
}

// Newton's method on the angle, in which the polynomial is well behaved. Angles near 90 degrees
// have no point on the plane z = 1.
std::optional<Vector2d> UndistortEquidistant(const Eigen::Vector4d& k, const Vector2d& target) {
  const double theta_d = target.norm();
  if (theta_d < 1e-9) {
    return target;
  }
  double theta = theta_d;
  for (int i = 0; i < 20; ++i) {
    const double t2 = theta * theta;
    const double error =
        theta * (1 + t2 * (k[0] + t2 * (k[1] + t2 * (k[2] + t2 * k[3])))) - theta_d;
    const double slope = 1 + t2 * (3 * k[0] + t2 * (5 * k[1] + t2 * (7 * k[2] + t2 * 9 * k[3])));
    if (!(slope > 1e-6)) {
      return std::nullopt;
    }
    theta -= error / slope;
    if (std::abs(error) < 1e-13) {
      constexpr double kMaxAngle = 1.56;
      return theta > 0 && theta < kMaxAngle
                 ? std::make_optional<Vector2d>(target * (Tan(theta) / theta_d))
                 : std::nullopt;
    }
  }
  return std::nullopt;
}

}  // namespace

std::optional<Vector2d> CameraModel::Project(const Eigen::Vector3d& p_cam,
                                             Eigen::Matrix<double, 2, 3>* jacobian) const {
  constexpr double kMinDepth = 1e-6;
  if (p_cam.z() < kMinDepth) {
    return std::nullopt;
  }
  const double inv_z = 1.0 / p_cam.z();
  const Vector2d xy = p_cam.head<2>() * inv_z;
  Matrix2d J_distort;
  const Vector2d d = Distort(kind, distortion, xy, &J_distort);
  // Where the determinant is not positive, the polynomial folds back: no light ray is there.
  if (!(J_distort.determinant() > 0) || J_distort.trace() <= 0) {
    return std::nullopt;
  }
  if (jacobian != nullptr) {
    Eigen::Matrix<double, 2, 3> J_plane;
    J_plane << inv_z, 0, -xy.x() * inv_z, 0, inv_z, -xy.y() * inv_z;
    *jacobian = Eigen::DiagonalMatrix<double, 2>(fx, fy) * J_distort * J_plane;
  }
  return Vector2d(fx * d.x() + cx, fy * d.y() + cy);
}

std::optional<Vector2d> CameraModel::Unproject(const Vector2d& pixel) const {
  const Vector2d target((pixel.x() - cx) / fx, (pixel.y() - cy) / fy);
  return kind == Kind::kRadtan ? UndistortRadtan(distortion, target)
                               : UndistortEquidistant(distortion, target);
}

// Both models are linear in their coefficients.
Matrix2d CameraModel::DistortionJacobian(const Vector2d& ray) const {
  const Vector2d without = Distort(kind, Eigen::Vector4d::Zero(), ray, nullptr);
  Matrix2d J;
  for (int i = 0; i < 2; ++i) {
    J.col(i) = Distort(kind, Eigen::Vector4d::Unit(i), ray, nullptr) - without;
  }
  return Eigen::DiagonalMatrix<double, 2>(fx, fy) * J;
}

bool CameraModel::Contains(const Vector2d& pixel, double border) const {
  return pixel.x() >= border && pixel.y() >= border && pixel.x() <= width - 1 - border &&
         pixel.y() <= height - 1 - border;
}

double CameraModel::RowTime_s(double row) const {
  return height > 1 ? readout_s * row / (height - 1) : 0;
}

std::optional<std::string> CameraModel::Invalid() const {
  if (width < 16 || height < 16 || width > 2047 || height > 2047) {
    return "image size must be 16 to 2047 pixels";
  }
  if (!(fx > 1 && fx < 1e5 && fy > 1 && fy < 1e5)) {
    return "focal lengths must be between 1 and 1e5 pixels";
  }
  // The principal point of a cropped image may lie outside it, by one image size at most.
  if (!(cx > -width && cx < 2 * width && cy > -height && cy < 2 * height)) {
    return fmt::format("the principal point ({:.4g}, {:.4g}) is far outside of {} x {} pixels", cx,
                       cy, width, height);
  }
  if (!distortion.allFinite() || distortion.cwiseAbs().maxCoeff() > 1e3) {
    return "the distortion coefficients must be finite, and at most 1000";
  }
  if (!T_body_cam.t.allFinite() || !(std::abs(T_body_cam.q.norm() - 1) < 1e-6)) {
    return "T_body_cam must be a finite rigid transform";
  }
  if (T_body_cam.t.norm() > kMaxLever_m) {
    return fmt::format("the camera is {:.3g} m from the body; at most {} are plausible",
                       T_body_cam.t.norm(), kMaxLever_m);
  }
  if (!(std::abs(time_offset_s) < 10)) {
    return fmt::format("the time offset must be below 10 s, not {:.4g}", time_offset_s);
  }
  if (!(readout_s >= 0 && readout_s < 1)) {
    return fmt::format("the read-out must be 0 to 1 s, not {:.4g}", readout_s);
  }
  return std::nullopt;
}

}  // namespace pangea
