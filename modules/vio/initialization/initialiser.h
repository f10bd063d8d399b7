#pragma once

// The first state of a map, from a second or two of tracks and inertial samples.
//
// Stationary: gravity from the accelerometer, gyro bias from the gyro. Moving: the gyro bias that
// makes every pair of images epipolar (Kneip & Lynen, ICCV 2013; He et al., CVPR 2023), then
// velocity and gravity in closed form with |g| known (Dong-Si & Mourikis, IROS 2012), then bundle
// adjustment with preintegrated IMU. A solution that is not well determined, or does not explain
// the images, is refused with a reason: a bad start costs more than a late one.

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
#include "vio/initialization/initial_solution.h"
#include "vio/window/window_state.h"

namespace pangea::vio {

// odom: z up, origin at the body now, yaw free.
struct InitialState {
  // The frames the start was found from, oldest first, the newest last; one if it was stationary.
  struct Frame {
    TrackedFrame tracked;      // its utime is the IMU's
    ImuState imu;              // at this time
    double stamp_error_s = 0;  // of this image by itself
  };
  std::vector<Frame> frames;
  bool stationary = false;
  // Of the stationary start: (dtheta left, dp, dv, gyro bias, accel bias), in odom.
  Eigen::Matrix<double, 15, 15> covariance = Eigen::Matrix<double, 15, 15>::Identity();
  // The frames' utime is this much later than they were told with, and the images were taken this
  // much later still.
  double time_offset_change_s = 0;
  double time_offset_error_s = 0;
};

struct InitialResult {
  std::optional<InitialState> state;
  std::string reason;        // why there is none yet
  bool contradicts = false;  // because images and inertial samples do not fit
};

class Initialiser {
 public:
  // `pixel_sigma`: of an observation, pixels. Of `sigmas`, AddFrame says `stamp_s` anew.
  Initialiser(const CameraModel& camera, const ImuNoise& noise, double pixel_sigma,
              const StartSigmas& sigmas, const StationaryOptions& stationary);

  // Frames in time order, with the samples since the previous frame (the last one at or after the
  // frame). `stamp_sigma_s`: of the frames' stamps, as known by now; 0: they are exact.
  InitialResult AddFrame(const TrackedFrame& frame, std::span<const ImuSample> imu,
                         double stamp_sigma_s);

 private:
  InitialResult Try();
  std::optional<InitialState> TryStationary() const;
  InitialResult TryMoving();
  InitialResult TryMoving(const std::vector<StartFrame>& frames) const;
  std::optional<InitialResult> Refusal(const std::optional<RefinedStart>& refined) const;
  std::vector<StartFrame> StartFrames() const;

  CameraModel camera_;
  ImuNoise noise_;
  double pixel_sigma_;
  StartSigmas sigmas_;
  StationaryOptions stationary_;
  std::vector<TrackedFrame> frames_;
  std::vector<ImuSample> samples_;  // from before the oldest frame to after the newest
  double time_offset_change_s_ = 0;
  std::string why_not_ = "collecting images";  // at the newest try
};

}  // namespace pangea::vio
