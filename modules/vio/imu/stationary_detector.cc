#include "vio/imu/stationary_detector.h"

#include "vio/imu/imu_noise.h"

namespace pangea::vio {
namespace {

using Eigen::Vector3d;

constexpr double kSpan_s = 0.5;
constexpr size_t kSamples = 50;

double Seconds(int64_t us) { return 1e-6 * static_cast<double>(us); }

}  // namespace

bool StationaryDetector::HasStoodForAWhile(const TrackedFrame& frame) const {
  const int64_t first = recent_utimes_.front();
  return Seconds(frame.utime - first) >= kSpan_s &&
         recent_.ShiftSigmasBetween(first, frame.utime).median < kStationarySigmas;
}

bool StationaryDetector::AddFrame(const TrackedFrame& frame,
                                  const std::optional<TrackHistory::ShiftSigmas>& since_stop,
                                  const ImuBuffer& imu, const Vector3d& gyro_bias) {
  recent_.AddFrame(frame, camera_, ray_sigma_);
  recent_utimes_.push_back(frame.utime);
  while (recent_utimes_.size() > 2 && Seconds(frame.utime - recent_utimes_[1]) >= kSpan_s) {
    recent_.RemoveFrame(recent_utimes_.front());
    recent_utimes_.pop_front();
  }
  const bool images_stand =
      since_stop ? since_stop->median < kStationarySigmas : HasStoodForAWhile(frame);
  const SampleMoments moments = MomentsOf(imu.Latest(kSamples));
  const bool stands = images_stand && (moments.gyro_mean - gyro_bias).norm() < kMaxStationaryRate;
  const bool quiet = moments.accel_variance < options_.accel_sigma * options_.accel_sigma;
  if (quiet || !since_stop || !rest_accel_) {
    rest_accel_ = moments.accel_mean;
  }
  const bool only_shaken = since_stop && since_stop->most < kStationaryMostSigmas &&
                           (moments.accel_mean - *rest_accel_).norm() < kMaxStationaryAccelChange;
  return stands && (quiet || only_shaken);
}

}  // namespace pangea::vio
