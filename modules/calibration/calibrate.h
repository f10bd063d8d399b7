#pragma once

// Calibrates a camera and an IMU against each other, without a target or initial values: gyroscope
// against tracked points.
//
// Input: tracks of a hand-held recording of 20 to 60 s, inertial samples, the image size,
// optionally a field of view and the camera's axes. Output: rotation camera to body, gyro bias,
// time offset, focal length, principal point, distortion and read-out time, each with a standard
// deviation; or the reason of a refusal, and what to record instead. The translation camera to body
// is not calibrated: the odometry estimates it.

#include <optional>
#include <string>
#include <vector>

#include "calibration/coverage.h"
#include "calibration/parameters.h"
#include "core/imu/imu.h"
#include "vio/front_end/tracks.h"

namespace pangea::calibration {

struct Input {
  int width = 0, height = 0;  // pixels
  std::vector<vio::TrackedFrame> frames;
  std::vector<ImuSample> imu;
  // Noise, and residual errors after the IMU's own calibration (core/imu/imu.h).
  ImuNoise imu_noise;
  std::optional<double> field_of_view;           // of the wider side, radians
  std::optional<Eigen::Quaterniond> q_body_cam;  // approximate, to some degrees
  // Refuse a given rotation if another one fits better. Takes as long as if none were given.
  bool check_rotation = false;
  // Scale error of an uncalibrated gyroscope; the larger of this and that in `imu_noise` is used.
  double least_gyro_scale_sigma = 0.005;
};

struct Result {
  Parameters parameters;
  Tangent sigma = Tangent::Zero();
  Information covariance = Information::Zero();
  double sigma_px = 0;
  double inlier_share = 0;
  double image_rate_hz = 0;
  // Standard deviation of the variation of the time offset, if the exposure changes the interval
  // between images. `sigma` is of the offset at the usual interval.
  double time_offset_spread_s = 0;
  Coverage coverage;
  double next_cost = 0;  // cost of the next best rotation / cost of the best; 0: only one
  std::string refused;   // reason of a refusal; empty: accepted
  // If the given rotation is refused: the one that fits better.
  std::optional<Eigen::Quaterniond> better_q_body_cam;
};

Result Calibrate(const Input& input);

// Coverage of the input, before calibration. Without `q_body_cam` the rotation rates are about the
// body's axes.
Coverage RoughCoverage(const Input& input);

}  // namespace pangea::calibration
