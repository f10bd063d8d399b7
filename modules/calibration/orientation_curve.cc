#include "calibration/orientation_curve.h"

#include <algorithm>

#include "core/rigid3.h"

namespace pangea::calibration {

OrientationCurve::OrientationCurve(std::span<const ImuSample> imu, int64_t origin_utime,
                                   const Eigen::Vector3d& bias) {
  q_start_body_.push_back(Eigen::Quaterniond::Identity());
  for (size_t i = 0; i < imu.size(); ++i) {
    times_.push_back(1e-6 * static_cast<double>(imu[i].utime - origin_utime));
    const Eigen::Vector3d& next = imu[std::min(i + 1, imu.size() - 1)].gyro;
    rates_.push_back(0.5 * (imu[i].gyro + next) - bias);
    if (i > 0) {
      const double dt = times_[i] - times_[i - 1];
      q_start_body_.push_back((q_start_body_.back() * ExpSo3(rates_[i - 1] * dt)).normalized());
    }
  }
}

size_t OrientationCurve::IntervalOf(double t_s) const {
  const auto after = std::upper_bound(times_.begin(), times_.end(), t_s);
  return after == times_.begin() ? 0 : static_cast<size_t>(after - times_.begin()) - 1;
}

Eigen::Quaterniond OrientationCurve::At(double t_s) const {
  const size_t i = IntervalOf(t_s);
  return q_start_body_[i] * ExpSo3(rates_[i] * (t_s - times_[i]));
}

bool OrientationCurve::Covers(double begin_s, double end_s) const {
  if (begin_s < times_.front() || end_s > times_.back()) {
    return false;
  }
  for (size_t i = IntervalOf(begin_s); i + 1 < times_.size() && times_[i] < end_s; ++i) {
    if (times_[i + 1] - times_[i] > kMaxGap_s) {
      return false;
    }
  }
  return true;
}

}  // namespace pangea::calibration
