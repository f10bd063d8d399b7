#pragma once

// What is calibrated, with the tangent that steps and covariances are of.

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
  kLogFocal = 7,        // of the one focal length
  kCentre = 8,          // px
  kDistortion = 10,     // the first two coefficients; the others are 0
  kReadout = 12,        // s, first row to last
  kIntervalShare = 13,  // of time
  kSize = 14
};
using Tangent = Eigen::Matrix<double, kSize, 1>;
using Information = Eigen::Matrix<double, kSize, kSize>;

struct Parameters {
  // Pinhole with one focal length. Its time offset is of the first row, as in CameraModel.
  CameraModel camera;
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();
  // Where the exposure sets the frame rate, the time offset grows with the interval between images:
  // by this share of what an interval exceeds the usual one (vio/window/image_stamps.h).
  double interval_share = 0;

  double MiddleRowOffset_s() const { return camera.time_offset_s + 0.5 * camera.readout_s; }
  Parameters Plus(const Tangent& step) const;
  // this (-) other.
  Tangent Minus(const Parameters& other) const;
};

// Of the wider side, radians.
double FieldOfView(const CameraModel& camera);
// Focal length, pixels, of a field of view over the wider side.
double FocalOf(double field_of_view, const CameraModel& camera);

// What is known before: a normal distribution about `mean`, independent rows.
struct Prior {
  Parameters mean;
  Tangent sigma = Tangent::Ones();
};

}  // namespace pangea::calibration
