#pragma once

// The body's rotation over time from the gyroscope: q_start_body, with a constant bias subtracted.

#include <Eigen/Geometry>
#include <cstdint>
#include <span>
#include <vector>

#include "core/imu/imu.h"

namespace pangea::calibration {

class OrientationCurve {
 public:
  // Longer gaps between samples are not integrated.
  static constexpr double kMaxGap_s = 0.06;

  // `imu`: at least two samples, in time order. All times are seconds since `origin_utime`.
  OrientationCurve(std::span<const ImuSample> imu, int64_t origin_utime,
                   const Eigen::Vector3d& bias);

  Eigen::Quaterniond At(double t_s) const;
  // Whether samples cover the whole interval.
  bool Covers(double begin_s, double end_s) const;

 private:
  size_t IntervalOf(double t_s) const;

  std::vector<double> times_;
  std::vector<Eigen::Quaterniond> q_start_body_;
  std::vector<Eigen::Vector3d> rates_;  // of the interval after each sample
};

}  // namespace pangea::calibration
