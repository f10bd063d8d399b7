#include "vio/imu/stationary_detector.h"

#include "vio/imu/imu_noise.h"

namespace pangea::vio {
namespace {

using Eigen::Vector3d;

constexpr double kSpan_s = 0.5;
constexpr double kStillSigmas = 2.2;  // of the median shift: noise alone gives 1.7
constexpr size_t kSamples = 50;

double Seconds(int64_t us) { return 1e-6 * static_cast<double>(us); }

}  // namespace

bool StationaryDetector::IsQuiet(const ImuBuffer& imu, const Vector3d& gyro_bias) const {
  const SampleMoments moments = MomentsOf(imu.Latest(kSamples));
  return (moments.gyro_mean - gyro_bias).norm() < kMaxStationaryRate &&
         moments.accel_variance < options_.accel_sigma * options_.accel_sigma;
}

bool StationaryDetector::AddFrame(const TrackedFrame& frame, std::optional<double> shift_sigmas,
                                  const ImuBuffer& imu, const Vector3d& gyro_bias) {
  recent_.AddFrame(frame, camera_, ray_sigma_);
  recent_utimes_.push_back(frame.utime);
  while (recent_utimes_.size() > 2 && Seconds(frame.utime - recent_utimes_[1]) >= kSpan_s) {
    recent_.RemoveFrame(recent_utimes_.front());
    recent_utimes_.pop_front();
  }
  const int64_t first = recent_utimes_.front();
  const bool images_stand = shift_sigmas
                                ? *shift_sigmas < kStillSigmas
                                : Seconds(frame.utime - first) >= kSpan_s &&
                                      recent_.MedianShiftSigmas(first, frame.utime) < kStillSigmas;
  return images_stand && IsQuiet(imu, gyro_bias);
}

}  // namespace pangea::vio
