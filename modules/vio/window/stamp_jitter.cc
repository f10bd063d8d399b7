#include "vio/window/stamp_jitter.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/median.h"

namespace pangea::vio {
namespace {

constexpr size_t kStamps = 60;    // two or three seconds of images
constexpr size_t kMinStamps = 8;  // fewer are too few for an estimate
constexpr double kMadToSigma = 1.4826;
// Less is negligible: at 500 pixels/s, 0.2 ms moves a feature by a tenth of a pixel.
constexpr double kMinSigma_s = 2e-4;
constexpr double kMaxSigma_s = 0.02;

}  // namespace

// For evenly spaced times the second differences vanish; with jitter sigma their variance is 6
// sigma^2. The median of their magnitudes is not affected by a few changes of rate or missing
// images.
void StampJitter::AddFrame(int64_t utime) {
  utimes_.push_back(utime);
  if (utimes_.size() > kStamps) {
    utimes_.pop_front();
  }
  if (utimes_.size() < kMinStamps) {
    return;
  }
  std::vector<double> differences_s;
  for (size_t i = 2; i < utimes_.size(); ++i) {
    const int64_t second = utimes_[i] - 2 * utimes_[i - 1] + utimes_[i - 2];
    differences_s.push_back(1e-6 * std::abs(static_cast<double>(second)));
  }
  const double sigma_s = kMadToSigma * Median(std::move(differences_s)) / std::sqrt(6.0);
  sigma_s_ = sigma_s < kMinSigma_s ? 0 : std::min(sigma_s, kMaxSigma_s);
}

}  // namespace pangea::vio
