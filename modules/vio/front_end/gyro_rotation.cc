#include "vio/front_end/gyro_rotation.h"

#include <algorithm>

#include "core/rigid3.h"

namespace pangea::vio {

Eigen::Quaterniond GyroRotation::Between(int64_t from_utime, int64_t to_utime,
                                         const Eigen::Vector3d& gyro_bias) const {
  Eigen::Quaterniond q_from_at = Eigen::Quaterniond::Identity();
  int64_t at = from_utime;
  for (const ImuSample& sample : samples_) {
    const int64_t until = std::min(sample.utime, to_utime);
    if (until > at) {
      q_from_at =
          q_from_at * ExpSo3((sample.gyro - gyro_bias) * 1e-6 * static_cast<double>(until - at));
      at = until;
    }
  }
  return q_from_at;
}

}  // namespace pangea::vio
