#pragma once

// The first state of a map, from a second or two of tracks and inertial samples.
//
// Stationary start: gravity from the accelerometer, gyro bias from the gyro. Moving start: first
// the gyro bias, from the epipolar constraints of pairs of images (Kneip & Lynen, ICCV 2013; He et
// al., CVPR 2023); then velocity and gravity in closed form with known |g| (Dong-Si & Mourikis,
// IROS 2012); then bundle adjustment with preintegrated IMU. A solution that is poorly determined,
// or does not explain the images, is refused with a reason: a bad start is worse than a late one.
// When images and IMU go on not to fit, usual mistakes in the calibration are looked for
// (calibration_faults.h).

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/camera_model.h"
#include "core/imu/imu.h"
#include "vio/front_end/tracks.h"
#include "vio/imu/stationary_options.h"
#include "vio/initialisation/calibration_faults.h"
#include "vio/initialisation/initial_solution.h"
#include "vio/window/window_state.h"

namespace pangea::vio {

// Frame odom: z up, origin at the newest body position, arbitrary yaw.
struct InitialState {
  // The frames used for the start, oldest first; only one for a stationary start.
  struct Frame {
    TrackedFrame tracked;  // its utime is on the IMU's clock
    ImuState imu;
    double stamp_error_s = 0;  // of this image alone
  };
  std::vector<Frame> frames;
  bool stationary = false;
  // Only for a stationary start: (dtheta left, dp, dv, gyro bias, accel bias), in odom.
  Eigen::Matrix<double, 15, 15> covariance = Eigen::Matrix<double, 15, 15>::Identity();
  // The frames' states are later than their utime by time_offset_change_s; the images were taken
  // later still, by time_offset_error_s.
  double time_offset_change_s = 0;
  double time_offset_error_s = 0;
};

struct InitialResult {
  std::optional<InitialState> state;
  std::string reason;        // why there is no state yet
  bool contradicts = false;  // the reason is that images and IMU do not fit
  std::string suspect = {};  // what is probably wrong with the calibration; empty: not known
};

class Initialiser {
 public:
  // `pixel_sigma`: of an observation, pixels. AddFrame replaces `sigmas.stamp_s`.
  Initialiser(const CameraModel& camera, const ImuNoise& noise, double pixel_sigma,
              const StartSigmas& sigmas, const StationaryOptions& stationary);

  // Frames must come in time order, with the samples since the previous frame; the last sample is
  // at or after the frame. `stamp_sigma_s`: present estimate for the frames' stamps; 0: exact.
  InitialResult AddFrame(const TrackedFrame& frame, std::span<const ImuSample> imu,
                         double stamp_sigma_s);
  // Images and IMU have not fitted for a while: the gyro's rotations may be wrong for the camera.
  bool InDoubt() const;
  // After the start, with the same frames as before: some starts with a wrong focal length succeed.
  // Returns what is probably wrong; empty: nothing is known to be.
  std::string CheckFocalLength(const TrackedFrame& frame, std::span<const ImuSample> imu);

 private:
  std::optional<std::string> Collect(const TrackedFrame& frame, std::span<const ImuSample> imu);
  void DropImagesBeforeSamples();
  InitialResult Try();
  std::optional<InitialState> TryStationary() const;
  InitialResult TryMoving();
  // Empty if the motion does not determine velocity and gravity yet.
  std::optional<MovingStart> StartFrom(const Eigen::Vector3d& gyro_bias,
                                       const std::vector<StartFrame>& frames,
                                       const Rigid3& T_body_cam) const;
  InitialResult TryMoving(const std::vector<StartFrame>& frames, const Rigid3& T_body_cam) const;
  void NoteOutcome(const InitialResult& result);
  void LookForFaults();
  std::optional<InitialResult> Refusal(const std::optional<RefinedStart>& refined) const;
  std::vector<StartFrame> StartFrames(const CameraModel& camera, double shift_s) const;

  CameraModel camera_;
  ImuNoise noise_;
  double pixel_sigma_;
  StartSigmas sigmas_;
  StationaryOptions stationary_;
  std::vector<TrackedFrame> frames_;
  std::vector<ImuSample> samples_;  // from before the oldest frame to after the newest
  double time_offset_change_s_ = 0;
  std::string why_not_ = "collecting images";  // result of the newest attempt
  int contradictions_ = 0;          // attempts at which images and IMU did not fit, less the others
  int64_t last_attempt_utime_ = 0;  // at a moving start; then of the start, of each check
  std::optional<CalibrationFault> possible_fault_;  // found once
  FocalLengthCheck focal_length_check_;
  std::string suspect_;  // found twice, or by that check
};

}  // namespace pangea::vio
