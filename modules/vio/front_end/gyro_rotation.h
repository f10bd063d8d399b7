#pragma once

// The body's rotation between two times, from the newest gyroscope samples.

#include <Eigen/Geometry>
#include <cstdint>
#include <span>
#include <vector>

#include "core/imu/imu.h"

namespace pangea::vio {

class GyroRotation {
 public:
  void Add(std::span<const ImuSample> samples) {
    samples_.insert(samples_.end(), samples.begin(), samples.end());
  }
  // q_from_to, on the IMU's clock. Each sample holds from the one before it. Where there are no
  // samples, the body does not rotate.
  Eigen::Quaterniond Between(int64_t from_utime, int64_t to_utime,
                             const Eigen::Vector3d& gyro_bias) const;
  // Rotations are no longer asked for from before this time.
  void ForgetUntil(int64_t utime) {
    std::erase_if(samples_, [=](const ImuSample& sample) { return sample.utime <= utime; });
  }
  void Clear() { samples_.clear(); }

 private:
  std::vector<ImuSample> samples_;
};

}  // namespace pangea::vio
