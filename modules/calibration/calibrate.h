#pragma once

// Camera and IMU calibrated against each other from nothing: gyroscope against tracked points.
//
// In: tracks of a hand-held recording of 20 to 60 s, inertial samples, the image's size, perhaps a
// field of view and the camera's axes. Out: rotation camera to body, gyro bias, time offset, focal
// length, principal point, distortion, read-out, each with a standard deviation; or why not, and
// what to record instead. Translation camera to body is not asked: the odometry finds it.

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calibration/frame_pairs.h"
#include "calibration/parameters.h"
#include "calibration/search.h"
#include "calibration/solver.h"

namespace pangea::calibration {

struct Input {
  int width = 0, height = 0;  // pixels
  std::vector<vio::TrackedFrame> frames;
  std::vector<ImuSample> imu;
  // What calibration of the IMU leaves (core/imu/imu.h).
  ImuNoise imu_noise;
  std::optional<double> field_of_view;           // of the wider side, radians
  std::optional<Eigen::Quaterniond> q_body_cam;  // to some degrees
};

struct Options {
  FramePairOptions pairs;
  double search_gap_s = 0.12;  // of the pairs searched on: what is not yet known adds up over time
  SearchOptions search;
  SolverOptions solver;
  int max_refined = 9;      // hypotheses, on a part of the pairs
  int choose_on_every = 3;  // that part
  double min_seconds = 8;   // of pairs
  // What is known of any phone: standard deviations.
  double sigma_axis_aligned = 0.25;  // rad: of a rotation found among the 24
  double sigma_given_rotation = 0.1;
  double sigma_gyro_bias = 0.1;     // rad/s
  double sigma_gyro_scale = 0.005;  // as sold; larger where the recording says so
  double sigma_time_offset_s = 0.1;
  double sigma_log_focal = 0.3;  // 0.1 with a field of view
  double sigma_given_log_focal = 0.1;
  double sigma_centre = 0.02;  // of the wider side
  double sigma_distortion = 0.15;
  double sigma_distortion_equidistant = 0.03;
  double readout_s = 0.015;
  double sigma_readout_s = 0.012;
  // The result is refused beyond these.
  double max_sigma_rotation = 0.06;  // rad
  double max_sigma_log_focal = 0.05;
  double max_sigma_time_offset_s = 0.01;
  double max_sigma_px = 2.5;
  double min_field_of_view = 0.7, max_field_of_view = 2.3;  // rad
  double min_cost_ratio = 2;  // the next best rotation's over the best one's
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

Result Calibrate(const Input& input, const Options& options);

}  // namespace pangea::calibration
