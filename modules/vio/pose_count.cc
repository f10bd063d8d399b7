#include "vio/pose_count.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <utility>
#include <vector>

namespace pangea::vio {
namespace {

constexpr int64_t kStart_us = 3'000'000;
constexpr size_t kMostReasons = 3;

constexpr char kUnknown[] =
    "Likely causes: the accelerometer's or the gyroscope's sign or axes, T_BS (camera to body), "
    "the intrinsics, stamps of two clocks";

std::string WithoutNumbers(std::string text) {
  std::erase_if(text, [](unsigned char c) { return std::isdigit(c) != 0; });
  return text;
}

}  // namespace

void PoseCount::Add(int64_t utime) {
  first_utime_ = first_utime_.value_or(utime);
  ++images_;
  images_since_suspect_ += suspect_.empty() ? 0 : 1;
  late_images_ += utime - *first_utime_ > kStart_us ? 1 : 0;
}

void PoseCount::AddPose(int64_t utime, const std::string& suspect) {
  Add(utime);
  ++poses_;
  is_pose_suspect_ = !suspect.empty();
  suspect_ = is_pose_suspect_ ? suspect : suspect_;
  poses_since_suspect_ += suspect_.empty() ? 0 : 1;
}

void PoseCount::AddNone(int64_t utime, const std::string& reason, const std::string& suspect) {
  Add(utime);
  Reason& counted = reasons_[WithoutNumbers(reason)];
  ++counted.images;
  counted.newest = last_reason_ = reason;
  suspect_ = suspect.empty() ? suspect_ : suspect;
}

// The most frequent ones.
std::string PoseCount::Reasons() const {
  std::vector<Reason> sorted;
  for (const auto& [text, reason] : reasons_) {
    sorted.push_back(reason);
  }
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const Reason& a, const Reason& b) { return a.images > b.images; });
  sorted.resize(std::min(sorted.size(), kMostReasons));
  std::string text;
  for (const Reason& reason : sorted) {
    text += fmt::format("{}{} times: {}", text.empty() ? "" : "; ", reason.images, reason.newest);
  }
  return text;
}

bool PoseCount::AreFew() const {
  return 2 * poses_ < late_images_ || poses_ == 0 ||
         2 * poses_since_suspect_ < images_since_suspect_;
}

std::optional<std::string> PoseCount::WhyFew() const {
  const std::string probably = suspect_.empty() ? "" : "Probably " + suspect_;
  if (images_ == 0 || !(AreFew() || is_pose_suspect_)) {
    return std::nullopt;
  }
  if (!AreFew()) {
    return fmt::format("the poses are doubtful ({} of {} images have one). {}", poses_, images_,
                       probably);
  }
  if (poses_ == 0) {
    return fmt::format("no pose: the odometry did not start in {} images; at the last: {}{}",
                       images_, last_reason_, probably.empty() ? "" : ". " + probably);
  }
  return fmt::format("few poses: {} of {} images have one. {}. Why the others have none: {}",
                     poses_, images_, probably.empty() ? kUnknown : probably, Reasons());
}

}  // namespace pangea::vio
