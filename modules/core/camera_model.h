#pragma once

// Pinhole cameras with radial-tangential or equidistant (Kannala-Brandt) distortion.
//
// Pixels: the centre of the top-left pixel is (0, 0). Camera frame: z forward, x right, y down.
// A ray is a point of the camera frame on the plane z = 1 (so fields of view stay below 180
// degrees). Source: OpenCV's calib3d formulas; Kannala & Brandt, PAMI 2006 with four coefficients.

#include <Eigen/Core>
#include <optional>
#include <string>

#include "core/rigid3.h"

namespace pangea {

struct CameraModel {
  enum class Kind { kRadtan, kEquidistant };
  // Largest plausible distance from body to camera, which suffices for vehicles. A larger one is
  // probably not in metres.
  static constexpr double kMaxLever_m = 10;

  Kind kind = Kind::kRadtan;
  int width = 0;  // pixels
  int height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;  // pixels
  // kRadtan: k1 k2 p1 p2; kEquidistant: k1 k2 k3 k4
  Eigen::Vector4d distortion = Eigen::Vector4d::Zero();
  Rigid3 T_body_cam;         // p_body = T_body_cam * p_cam
  double time_offset_s = 0;  // t_imu = t_image + time_offset_s
  double readout_s = 0;      // from the first row to the last; 0: global shutter

  // Raw pixel of a point with z > 0. Nothing behind the camera, or where the distortion polynomial
  // folds back. `jacobian` may be null; it is d(pixel)/d(p_cam).
  std::optional<Eigen::Vector2d> Project(const Eigen::Vector3d& p_cam,
                                         Eigen::Matrix<double, 2, 3>* jacobian = nullptr) const;
  // The (x, y) of the ray (x, y, 1) through a raw pixel; nothing where the model has no inverse.
  std::optional<Eigen::Vector2d> Unproject(const Eigen::Vector2d& pixel) const;

  // For a ray: d(pixel)/d(the first two distortion coefficients).
  Eigen::Matrix2d DistortionJacobian(const Eigen::Vector2d& ray) const;

  // Whether the pixel is inside the image and at least `border` pixels from its edge.
  bool Contains(const Eigen::Vector2d& pixel, double border = 0) const;
  // Seconds from the exposure of the first row to that of `row`; 0 for a global shutter.
  double RowTime_s(double row) const;
  // The angle of one pixel at the image centre, radians.
  double PixelAngle() const { return 2.0 / (fx + fy); }
  // The reason why the model is invalid; nothing when it is valid.
  std::optional<std::string> Invalid() const;
};

}  // namespace pangea
