#include "vio/window/image_stamps.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "core/median.h"

namespace pangea::vio {
namespace {

constexpr size_t kIntervals = 5;  // two unusual intervals do not change their median
// In sigmas of the jitter: the largest and the smallest of 100,000 such medians differ by 5.8.
constexpr double kJitters = 6;
constexpr double kRounding_s = 1e-3;  // rounding of stamps to milliseconds

}  // namespace

void ImageStamps::AddImage(int64_t utime) {
  jitter_.AddFrame(utime);
  utimes_.push_back(utime);
  if (utimes_.size() > kIntervals + 1) {
    utimes_.pop_front();
  }
  if (const double now_s = interval_s(); now_s > 0) {
    shortest_s_ = shortest_s_ > 0 ? std::min(shortest_s_, now_s) : now_s;
    longest_s_ = std::max(longest_s_, now_s);
  }
}

bool ImageStamps::IsDifferent(double a_s, double b_s) const {
  return std::abs(a_s - b_s) > kRounding_s + kJitters * jitter_.sigma_s();
}

double ImageStamps::excess_interval_s() const {
  const double now_s = interval_s();
  return reference_s_ > 0 && IsDifferent(now_s, reference_s_) ? now_s - reference_s_ : 0;
}

double ImageStamps::sigma_s() const {
  if (const double jitter_s = jitter_.sigma_s(); jitter_s > 0) {
    return jitter_s;
  }
  const bool exposure_makes_it = !exposure_is_known_ && longest_s_ - shortest_s_ > kRounding_s;
  // Sigma of a uniform distribution
  return exposure_makes_it ? 0.5 * interval_s() / std::sqrt(12.0) : 0;
}

double ImageStamps::interval_s() const {
  if (utimes_.size() <= kIntervals) {
    return 0;
  }
  std::vector<double> intervals_s;
  for (size_t i = 1; i < utimes_.size(); ++i) {
    intervals_s.push_back(1e-6 * static_cast<double>(utimes_[i] - utimes_[i - 1]));
  }
  return Median(std::move(intervals_s));
}

}  // namespace pangea::vio
