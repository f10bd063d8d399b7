#pragma once

// Camera and IMU calibrated against each other from nothing: gyroscope against tracked points.
//
// In: tracks of a hand-held recording of 20 to 60 s, inertial samples, the image's size, perhaps a
// field of view and the camera's axes. Out: rotation camera to body, gyro bias, time offset, focal
// length, principal point, distortion, read-out, each with a standard deviation; or why not, and
// what to record instead. Translation camera to body is not asked: the odometry finds it.

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
  // What calibration of the IMU leaves (core/imu/imu.h).
  ImuNoise imu_noise;
  std::optional<double> field_of_view;           // of the wider side, radians
  std::optional<Eigen::Quaterniond> q_body_cam;  // to some degrees
  // Refuse a given rotation if another fits better. Takes as long as without a given one.
  bool check_rotation = false;
  // Of a gyroscope as sold; `imu_noise` counts where it says more.
  double least_gyro_scale_sigma = 0.005;
};

struct Result {
  Parameters parameters;
  Tangent sigma = Tangent::Zero();
  Information covariance = Information::Zero();
  double sigma_px = 0;
  double inlier_share = 0;
  double image_rate_hz = 0;
  // What the time offset varies by as the exposure changes the interval between images; standard
  // deviation. `sigma` is of the offset at the usual interval.
  double time_offset_spread_s = 0;
  Coverage coverage;
  double next_cost = 0;  // of the next best rotation, over the best one's; 0: there was none
  std::string refused;   // why; empty: it holds
  // Where the given rotation is refused: the one that fits better.
  std::optional<Eigen::Quaterniond> better_q_body_cam;
};

Result Calibrate(const Input& input);

// What Calibrate would find to work on. Without `q_body_cam` the rotation is about the body's axes.
Coverage RoughCoverage(const Input& input);

}  // namespace pangea::calibration
