#pragma once

// The inertial samples that frames of the window or an edge may still ask for. Times are the IMU's.

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
  // Drops what is older than this, but for a margin and the newest few.
  void Forget(int64_t before_utime);

  // What is missing for a span of time, in words; nothing when it is covered.
  std::optional<std::string> Gap(int64_t from_utime, int64_t to_utime) const;
  // With the noise that the samples show, not less than the data sheet's (imu_noise.h).
  ScaledPreintegration Integrate(int64_t from_utime, int64_t to_utime,
                                 const ImuIntrinsics& intrinsics, const Eigen::Vector3d& gyro_bias,
                                 const Eigen::Vector3d& accel_bias) const;
  // The first at or after this time, else the last of all. There must be one.
  const ImuSample& At(int64_t utime) const;
  // Rotation and acceleration from a time on, so that they hold at the middle and the end of
  // `duration_s`; for none, the rotation rate then. The velocity is left open.
  BodyMotion MotionFrom(int64_t utime, double duration_s, const ImuIntrinsics& intrinsics,
                        const ImuState& state) const;
  // The newest of them, `count` or as many as there are.
  std::vector<ImuSample> Latest(size_t count) const;

 private:
  ImuNoise NoiseAround(int64_t from_utime, int64_t to_utime) const;

  ImuNoise noise_;
  std::vector<ImuSample> samples_;
};

}  // namespace pangea::vio
