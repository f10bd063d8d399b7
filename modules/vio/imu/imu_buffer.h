#pragma once

// The inertial samples that the window or an odometry edge may still need. All times are on the
// IMU's clock (microseconds).

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/imu/imu.h"
#include "core/imu/imu_factor.h"
#include "core/imu/preintegration.h"
#include "vio/imu/body_motion.h"
#include "vio/imu/imu_intrinsics.h"

namespace pangea::vio {

class ImuBuffer {
 public:
  explicit ImuBuffer(const ImuNoise& noise) : noise_(noise) {}

  void Add(std::span<const ImuSample> samples);
  // Drops samples older than this, except for a margin and the newest 100 samples.
  void Forget(int64_t before_utime);

  // A text for people about missing samples in a span of time; empty if the samples cover it.
  std::optional<std::string> Gap(int64_t from_utime, int64_t to_utime) const;
  // Preintegrates with the noise density that the samples show, within bounds (imu_noise.h).
  ScaledPreintegration Integrate(int64_t from_utime, int64_t to_utime,
                                 const ImuIntrinsics& intrinsics, const Eigen::Vector3d& gyro_bias,
                                 const Eigen::Vector3d& accel_bias) const;
  // The first sample at or after this time, else the newest. The buffer must not be empty.
  const ImuSample& At(int64_t utime) const;
  // Rotation and acceleration from `utime` on, fitted to the IMU at the middle and the end of
  // `duration_s`. If `duration_s` is 0: only the rotation rate. The velocity is not set.
  BodyMotion MotionFrom(int64_t utime, double duration_s, const ImuIntrinsics& intrinsics,
                        const ImuState& state) const;
  // The newest `count` samples, or all if there are fewer.
  std::vector<ImuSample> Latest(size_t count) const;

 private:
  ImuNoise NoiseAround(int64_t from_utime, int64_t to_utime) const;

  ImuNoise noise_;
  std::vector<ImuSample> samples_;
};

}  // namespace pangea::vio
