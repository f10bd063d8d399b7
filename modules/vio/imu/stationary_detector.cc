#include "vio/imu/stationary_detector.h"

#include <vector>

#include "vio/imu/imu_noise.h"

namespace pangea::vio {
namespace {

using Eigen::Vector3d;

constexpr double kSpan_s = 0.5;
constexpr double kStillSigmas = 2.2;    // of the median shift: noise alone gives 1.7
constexpr double kMaxGyro = 0.05;       // rad/s, mean rate less bias
constexpr double kMaxAccelSigma = 0.3;  // m/s^2, standard deviation
constexpr size_t kSamples = 50;

double Seconds(int64_t us) { return 1e-6 * static_cast<double>(us); }

bool IsQuiet(const std::vector<ImuSample>& samples, const Vector3d& gyro_bias) {
  const SampleMoments moments = MomentsOf(samples);
  return (moments.gyro_mean - gyro_bias).norm() < kMaxGyro &&
         moments.accel_variance < kMaxAccelSigma * kMaxAccelSigma;
}

}  // namespace

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
  return images_stand && IsQuiet(imu.Latest(kSamples), gyro_bias);
}

}  // namespace pangea::vio
