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
  double seconds = 0;    // of pairs
  double points = 0;     // of a pair, median
  double next_cost = 0;  // of the next best rotation, over the best one's; 0: there was none
  Eigen::Vector3d rotation_rms = Eigen::Vector3d::Zero();  // rad/s about the camera's axes
  std::string refused;                                     // why; empty: it holds
};

Result Calibrate(const Input& input);

}  // namespace pangea::calibration
