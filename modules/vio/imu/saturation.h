#pragma once

// Finds readings at the end of the IMU's range, whatever this range is: an axis repeats one large
// value exactly while another axis of the same sensor changes. (If all axes repeat, samples are
// only copied to a higher rate.) Beyond the range the motion is unknown, and no noise density
// covers it.

#include <optional>

#include "core/imu/imu.h"

namespace pangea::vio {

class SaturationDetector {
 public:
  // Samples in the order of time. Whether this one is the third or a later one at the end of the
  // range.
  bool Add(const ImuSample& sample);

 private:
  static constexpr int kRepeats = 3;  // a value may come twice by chance

  std::optional<ImuSample> last_;
  Eigen::Array3i gyro_repeats_ = Eigen::Array3i::Zero();  // by axis, until another axis changes
  Eigen::Array3i accel_repeats_ = Eigen::Array3i::Zero();
};

}  // namespace pangea::vio
