#pragma once

// Detects whether the body is stationary: the image has moved by no more than its noise, since the
// body stopped or during the last half second, and the IMU is quiet.

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

  // Call in time order. Returns whether the body is stationary at this frame. `shift_sigmas`: how
  // far the image has moved since the body stopped, if it has (TrackHistory::MedianShiftSigmas).
  bool AddFrame(const TrackedFrame& frame, std::optional<double> shift_sigmas, const ImuBuffer& imu,
                const Eigen::Vector3d& gyro_bias);

 private:
  bool IsQuiet(const ImuBuffer& imu, const Eigen::Vector3d& gyro_bias) const;

  CameraModel camera_;
  double ray_sigma_;
  StationaryOptions options_;
  TrackHistory recent_;
  std::deque<int64_t> recent_utimes_;
};

}  // namespace pangea::vio
