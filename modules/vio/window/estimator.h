#pragma once

// Visual-inertial odometry of one map: tracked features and inertial samples in, poses and finished
// keyframes out.
//
// Initialises itself, stationary or moving (initialiser.h), then optimises over a sliding window of
// frames; frames that leave the window are marginalised into a prior (window_problem.h). The odom
// frame is gravity-aligned (z up), with the origin and yaw of the first pose. Uses no thread, clock
// or file: the same input gives the same output.

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/calibration_sigmas.h"
#include "core/camera_model.h"
#include "core/imu/imu.h"
#include "core/imu/preintegration.h"
#include "core/keyframe.h"
#include "core/rigid3.h"
#include "vio/front_end/tracks.h"
#include "vio/imu/body_motion.h"
#include "vio/imu/stationary_options.h"
#include "vio/window/window_poses.h"

namespace pangea::vio {

struct EstimatorOptions {
  int window = 12;  // keyframes in the window
  // Parallax (median shift of the features, rotation taken out) at which a frame becomes a window
  // keyframe, which keeps its place in the window, and a keyframe, which is published. Measured
  // since the last one of the kind. frame_choice.h has further criteria.
  double window_parallax_px = 15;
  double keyframe_parallax_px = 20;
  double pixel_sigma = 0.7;        // pixels, of an observation with sigma_px 1
  double accel_bias_sigma = 0.15;  // m/s^2, when the IMU is switched on
  CalibrationSigmas calibration;
  StationaryOptions stationary;

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Add("window", &window, {4, 100}, "", "keyframes");
    archive.Add("window_parallax_px", &window_parallax_px, {0.1, 1000}, "px",
                "since the last window keyframe, for another");
    archive.Add("pixel_sigma", &pixel_sigma, {0.01, 20}, "px", "of an observation with sigma_px 1");
    archive.Add("keyframe_parallax_px", &keyframe_parallax_px, {0.1, 1000}, "px",
                "since the last keyframe, for another");
    archive.Add("accel_bias_sigma", &accel_bias_sigma, {0.001, 5}, "m/s^2",
                "of the accelerometer's bias when it is switched on; a cheap one may have more");
    archive.Section("calibration", &calibration,
                    "how well the given one is known, where the recording does not say");
    archive.Section("stationary", &stationary, "what the IMU may show when the body stands still");
  }
};

enum class EstimatorState { kInitialising, kTracking, kLost };

struct LandmarkDepth {
  int32_t landmark_id = 0;
  double inverse_depth = 0;      // 1/m, along the camera's z axis
  double inverse_depth_var = 0;  // 1/m^2
};

// A keyframe that left the window or has waited long enough; all its values are final.
struct FinishedKeyframe {
  int64_t utime = 0;  // of the TrackedFrame
  Rigid3 T_odom_body;
  Eigen::Vector3d v_odom_body = Eigen::Vector3d::Zero();
  BodyMotion motion;  // from there on
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_bias = Eigen::Vector3d::Zero();
  // Covariance of roll and pitch: about the x and y axes of odom
  Eigen::Matrix2d roll_pitch_covariance = Eigen::Matrix2d::Identity();
  // Covariance of the whole state (15), in the window's coordinates (window_state.h).
  Eigen::Matrix<double, 15, 15> covariance = Eigen::Matrix<double, 15, 15>::Identity();
  // Odometry edge from the previous finished keyframe; empty for the map's first keyframe.
  struct Edge {
    Rigid3 T_previous_this;
    Matrix6d covariance = Matrix6d::Identity();  // (translation, rotation) in previous' body frame
  };
  std::optional<Edge> edge;
  // Preintegration of the same span; empty if the images contradict it (unmodelled_acceleration.h).
  std::optional<Preintegration> preintegration;
  std::vector<LandmarkDepth> landmarks;
  // (translation, rotation), perturbation in the left frame (body)
  Matrix6d T_body_cam_covariance = Matrix6d::Zero();
  // Relative sigma of the scale, from the depths; empty if there are too few depths.
  std::optional<double> scale_sigma;
};

struct FrameResult {
  EstimatorState state = EstimatorState::kInitialising;
  std::string reason;   // why it is not tracking
  std::string suspect;  // what is probably wrong with the calibration (initialiser.h)
  // Before the start, images and IMU have not fitted for a while.
  bool in_doubt = false;
  Rigid3 T_odom_body;  // at this frame; valid if state is kTracking
  Eigen::Vector3d v_odom_body = Eigen::Vector3d::Zero();
  BodyMotion motion;  // from there on
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_bias = Eigen::Vector3d::Zero();
  bool is_keyframe = false;       // this frame will be finished as a keyframe later
  bool stationary = false;        // the body is, and its pose is held
  bool imu_contradicted = false;  // the IMU measures an acceleration that the images do not show
  std::vector<FinishedKeyframe> finished;
  std::vector<int32_t> outlier_landmarks;  // the tracker should drop these
};

class Estimator {
 public:
  Estimator(const EstimatorOptions& options, const CameraModel& camera, const ImuNoise& noise);
  ~Estimator();
  Estimator(Estimator&&) noexcept;
  Estimator& operator=(Estimator&&) noexcept;

  // Frames must come in time order. `imu`: all samples after those of the previous call, up to and
  // including the first one at or after this frame's time.
  FrameResult AddFrame(const TrackedFrame& frame, std::span<const ImuSample> imu);
  // At the end: finishes and returns the keyframes that are still in the window.
  std::vector<FinishedKeyframe> Flush();
  // The calibration in use, refined online.
  CameraModel camera() const;
  // The window's poses after the newest frame; only while tracking. Takes about as long as one
  // iteration.
  WindowPoses Poses() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace pangea::vio
