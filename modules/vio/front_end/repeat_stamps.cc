#include "vio/front_end/repeat_stamps.h"

#include <map>
#include <utility>
#include <vector>

#include "core/rigid3.h"
#include "vio/front_end/two_view_check.h"

namespace pangea::vio {
namespace {

constexpr double kKept = 0.98;           // of the moments, from image to image
constexpr double kMinCount = 5;          // pairs of images
constexpr double kRotationSigma = 0.02;  // rad
constexpr double kClearly = 0.4;         // ratio of the variances
constexpr int kMinFeatures = 10;         // that both images see

double SpanSeconds(int64_t from_utime, int64_t to_utime) {
  return 1e-6 * static_cast<double>(to_utime - from_utime);
}

}  // namespace

void RepeatStamps::Moments::Add(const Eigen::Vector3d& value) {
  count = kKept * count + 1;
  sum = kKept * sum + value;
  sum_of_squares = kKept * sum_of_squares + value.squaredNorm();
}

double RepeatStamps::Moments::Variance() const {
  return (sum_of_squares - sum.squaredNorm() / count) / count;
}

std::optional<int64_t> RepeatStamps::oldest_utime() const {
  return before_ ? std::optional(before_->frame.utime) : std::nullopt;
}

void RepeatStamps::EndTracks() {
  before_.reset();
  newest_.reset();
}

void RepeatStamps::AddRepeat(int64_t utime) {
  if (newest_) {
    newest_->last_utime = utime;
  }
}

void RepeatStamps::AddNew(const TrackedFrame& frame, const Rotation& rotation) {
  if (before_ && newest_) {
    Compare(rotation);
  }
  before_ = std::exchange(newest_, Run{frame, frame.utime});
}

// The rotation that the images show beyond that of the gyroscope.
std::optional<Eigen::Vector3d> RepeatStamps::Error(const Eigen::Quaterniond& q_now_before) const {
  std::map<int32_t, Eigen::Vector2d> rays;
  for (const Observation& one : before_->frame.observations) {
    rays[one.landmark_id] = one.ray;
  }
  std::vector<Eigen::Vector2d> rays_before, rays_now;
  for (const Observation& one : newest_->frame.observations) {
    if (const auto ray = rays.find(one.landmark_id); ray != rays.end()) {
      rays_before.push_back(ray->second);
      rays_now.push_back(one.ray);
    }
  }
  TwoViewOptions options;
  options.rotation_sigma = kRotationSigma;
  const TwoViewResult seen =
      CheckTwoView(rays_before, rays_now, q_now_before, camera_.PixelAngle(), options);
  if (seen.num_inliers < kMinFeatures) {
    return std::nullopt;
  }
  return LogSo3(seen.q_b_a * q_now_before.conjugate());
}

void RepeatStamps::Compare(const Rotation& rotation) {
  const int64_t first_utime = before_->frame.utime, now_first_utime = newest_->frame.utime;
  const int64_t last_utime = before_->last_utime, now_last_utime = newest_->last_utime;
  if (first_utime == last_utime && now_first_utime == now_last_utime) {
    return;
  }
  const auto by_first = Error(rotation(first_utime, now_first_utime));
  const auto by_last = Error(rotation(last_utime, now_last_utime));
  if (!by_first || !by_last) {
    return;
  }
  by_first_.Add(*by_first / SpanSeconds(first_utime, now_first_utime));
  by_last_.Add(*by_last / SpanSeconds(last_utime, now_last_utime));
  const Moments& in_use = last_is_right_ ? by_last_ : by_first_;
  const Moments& other = last_is_right_ ? by_first_ : by_last_;
  if (in_use.count > kMinCount && other.Variance() < kClearly * in_use.Variance()) {
    last_is_right_ = !last_is_right_;
  }
}

}  // namespace pangea::vio
