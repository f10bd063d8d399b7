#pragma once

// Detects whether the body is stationary: the image has moved by no more than its noise, since the
// body stopped or during the last half second, and the IMU is quiet. A stationary body may be
// shaken, as by motors or steps on the floor: it stays stationary while hardly a track moves and
// the IMU's means stay.

#include <Eigen/Core>
#include <cstdint>
#include <deque>
#include <optional>

#include "core/camera_model.h"
#include "vio/front_end/tracks.h"
#include "vio/imu/imu_buffer.h"
#include "vio/imu/stationary_options.h"
#include "vio/keyframes/track_history.h"

namespace pangea::vio {

class StationaryDetector {
 public:
  // `ray_sigma`: of an observation with sigma_px 1, on the plane z = 1.
  StationaryDetector(const CameraModel& camera, double ray_sigma, const StationaryOptions& options)
      : camera_(camera), ray_sigma_(ray_sigma), options_(options) {}

  // Call in time order. Returns whether the body is stationary at this frame. `since_stop`: how far
  // the image has moved since the body stopped, if it has.
  bool AddFrame(const TrackedFrame& frame,
                const std::optional<TrackHistory::ShiftSigmas>& since_stop, const ImuBuffer& imu,
                const Eigen::Vector3d& gyro_bias);

 private:
  bool HasStoodForAWhile(const TrackedFrame& frame) const;

  CameraModel camera_;
  double ray_sigma_;
  StationaryOptions options_;
  TrackHistory recent_;
  std::deque<int64_t> recent_utimes_;
  // Mean specific force of the last quiet samples, or of the first ones since the body stopped.
  std::optional<Eigen::Vector3d> rest_accel_;
};

}  // namespace pangea::vio
