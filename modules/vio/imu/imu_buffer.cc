#include "vio/imu/imu_buffer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "vio/imu/imu_noise.h"

namespace pangea::vio {
namespace {

constexpr int64_t kMaxGap_us = 300'000;
constexpr int64_t kMaxSeen_us = 30'000;  // motion between samples that are closer is smooth
constexpr int64_t kMargin_us = 50'000;   // for changes of the estimated time offset
constexpr size_t kMinKept = 100;         // for the stationary detector and the noise measurement
constexpr std::ptrdiff_t kNoiseSamples = 100;

int64_t LongestStep(std::span<const ImuSample> samples) {
  int64_t longest_us = 0;
  for (size_t i = 0; i + 1 < samples.size(); ++i) {
    longest_us = std::max(longest_us, samples[i + 1].utime - samples[i].utime);
  }
  return longest_us;
}

}  // namespace

void ImuBuffer::Add(std::span<const ImuSample> samples) {
  samples_.insert(samples_.end(), samples.begin(), samples.end());
}

void ImuBuffer::Forget(int64_t before_utime) {
  size_t old = 0;
  while (samples_.size() - old > kMinKept && samples_[old + 1].utime < before_utime - kMargin_us) {
    ++old;
  }
  samples_.erase(samples_.begin(), samples_.begin() + static_cast<std::ptrdiff_t>(old));
}

std::optional<std::string> ImuBuffer::Gap(int64_t from_utime, int64_t to_utime) const {
  bool any = false;
  for (size_t i = 0; i + 1 < samples_.size(); ++i) {
    const ImuSample& a = samples_[i];
    const ImuSample& b = samples_[i + 1];
    if (b.utime <= from_utime || a.utime >= to_utime) {
      continue;
    }
    any = true;
    if (b.utime - a.utime > kMaxGap_us) {
      return fmt::format("the inertial samples have a gap of {:.2f} s",
                         1e-6 * static_cast<double>(b.utime - a.utime));
    }
  }
  if (!any || samples_.back().utime < to_utime - kMargin_us) {
    return "no inertial samples up to the image's time";
  }
  return std::nullopt;
}

ScaledPreintegration ImuBuffer::Integrate(int64_t from_utime, int64_t to_utime,
                                          const ImuIntrinsics& intrinsics,
                                          const Eigen::Vector3d& gyro_bias,
                                          const Eigen::Vector3d& accel_bias) const {
  // A changed time offset may ask for slightly later samples: the last one is extended.
  return IntegrateScaled(SamplesBetween(samples_, from_utime, to_utime),
                         NoiseAround(from_utime, to_utime), intrinsics, gyro_bias, accel_bias);
}

// Measures the noise on the span, extended backwards to kNoiseSamples samples if it is shorter, and
// allows for what a gap in it hides.
ImuNoise ImuBuffer::NoiseAround(int64_t from_utime, int64_t to_utime) const {
  const auto before = [](int64_t utime) {
    return [utime](const ImuSample& sample) { return sample.utime <= utime; };
  };
  const auto begin = std::partition_point(samples_.begin(), samples_.end(), before(from_utime));
  const auto end = std::partition_point(samples_.begin(), samples_.end(), before(to_utime));
  const auto enough = end - std::min<std::ptrdiff_t>(kNoiseSamples, end - samples_.begin());
  const std::vector<ImuSample> around(std::min(begin, enough), end);
  const ImuNoise noise = MeasuredNoise(noise_, around);
  // With the samples just before and behind the span.
  const auto number = [this](auto sample) {
    return static_cast<size_t>(sample - samples_.begin());
  };
  const auto up_to_end =
      std::span<const ImuSample>(samples_).first(std::min(number(end) + 1, samples_.size()));
  const size_t first = number(begin);
  const int64_t step_us = LongestStep(up_to_end.subspan(first > 0 ? first - 1 : 0));
  return step_us <= kMaxSeen_us
             ? noise
             : WithUnseenMotion(noise, step_us, up_to_end.subspan(number(std::min(begin, enough))));
}

const ImuSample& ImuBuffer::At(int64_t utime) const {
  const auto sample =
      std::partition_point(samples_.begin(), samples_.end(),
                           [utime](const ImuSample& one) { return one.utime < utime; });
  return sample == samples_.end() ? samples_.back() : *sample;
}

BodyMotion ImuBuffer::MotionFrom(int64_t utime, double duration_s, const ImuIntrinsics& intrinsics,
                                 const ImuState& state) const {
  BodyMotion motion;
  const auto duration_us = std::llround(1e6 * duration_s);
  if (duration_us <= 0) {
    motion.omega = intrinsics.Corrected(At(utime)).gyro - state.gyro_bias;
    return motion;
  }
  const auto moved = [&](int64_t until) {
    return Integrate(utime, until, intrinsics, state.gyro_bias, state.accel_bias).measured;
  };
  const Preintegration half = moved(utime + duration_us / 2), whole = moved(utime + duration_us);
  if (half.duration_s <= 0 || whole.duration_s <= half.duration_s) {  // behind the newest sample
    motion.omega = intrinsics.Corrected(At(utime)).gyro - state.gyro_bias;
    return motion;
  }
  // Fit t omega + t^2 / 2 alpha to both rotations.
  const Eigen::Vector3d slope_half = LogSo3(half.delta_q) / half.duration_s;
  const Eigen::Vector3d slope_whole = LogSo3(whole.delta_q) / whole.duration_s;
  motion.alpha = 2 * (slope_whole - slope_half) / (whole.duration_s - half.duration_s);
  motion.omega = slope_whole - 0.5 * whole.duration_s * motion.alpha;
  motion.a = whole.delta_v / whole.duration_s -
             state.T_odom_body.q.conjugate() * Eigen::Vector3d(0, 0, kGravity);
  return motion;
}

std::vector<ImuSample> ImuBuffer::Latest(size_t count) const {
  const size_t kept = std::min(count, samples_.size());
  return {samples_.end() - static_cast<std::ptrdiff_t>(kept), samples_.end()};
}

}  // namespace pangea::vio
