#pragma once

// The calibrated parameters, and the tangent space of steps and covariances.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cmath>

#include "core/camera_model.h"

namespace pangea::calibration {

inline constexpr double kDegree = M_PI / 180;  // radians

// Rows of the tangent. kRotation: R_body_cam' = Exp(d) R_body_cam, radians, body axes.
enum Row : int {
  kRotation = 0,
  kGyroBias = 3,        // rad/s
  kTimeOffset = 6,      // s, of the middle row: t_imu = t_image + offset
  kLogFocal = 7,        // the focal length is the same for x and y
  kCentre = 8,          // px
  kDistortion = 10,     // first two coefficients; the others are 0
  kReadout = 12,        // s, first row to last
  kIntervalShare = 13,  // Parameters::interval_share
  kSize = 14
};
using Tangent = Eigen::Matrix<double, kSize, 1>;
using Information = Eigen::Matrix<double, kSize, kSize>;

struct Parameters {
  // Has one focal length for x and y. The time offset is that of the first row, as in CameraModel.
  CameraModel camera;
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();
  // If the exposure determines the frame rate, the time offset grows with the interval between
  // images: by this share of the interval's excess over the usual one (vio/window/image_stamps.h).
  double interval_share = 0;

  double MiddleRowOffset_s() const { return camera.time_offset_s + 0.5 * camera.readout_s; }
  Parameters Plus(const Tangent& step) const;
  // Returns this (-) other.
  Tangent Minus(const Parameters& other) const;
};

// Field of view of the wider side, radians.
double FieldOfView(const CameraModel& camera);
// Focal length in pixels, for a field of view of the wider side (radians).
double FocalOf(double field_of_view, const CameraModel& camera);

// A normal prior about `mean`, with independent rows.
struct Prior {
  Parameters mean;
  Tangent sigma = Tangent::Ones();
};

}  // namespace pangea::calibration
