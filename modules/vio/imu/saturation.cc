#include "vio/imu/saturation.h"

#include <cmath>

namespace pangea::vio {
namespace {

// Below the smallest ranges that are sold: 250 degrees/s and 2 g.
constexpr double kMinGyro = 4;    // rad/s
constexpr double kMinAccel = 19;  // m/s^2

// By axis: how many samples in a row, up to this one, have this value, if it is a large one.
void Count(const Eigen::Vector3d& last, const Eigen::Vector3d& now, double least,
           Eigen::Array3i* repeats) {
  const auto same = now.array() == last.array();
  if (same.all()) {
    return;
  }
  for (int axis = 0; axis < 3; ++axis) {
    const bool large = std::abs(now[axis]) >= least;
    (*repeats)[axis] = !large ? 0 : same[axis] ? (*repeats)[axis] + 1 : 1;
  }
}

}  // namespace

bool SaturationDetector::Add(const ImuSample& sample) {
  if (last_) {
    Count(last_->gyro, sample.gyro, kMinGyro, &gyro_repeats_);
    Count(last_->accel, sample.accel, kMinAccel, &accel_repeats_);
  }
  last_ = sample;
  return gyro_repeats_.maxCoeff() >= kRepeats || accel_repeats_.maxCoeff() >= kRepeats;
}

}  // namespace pangea::vio
