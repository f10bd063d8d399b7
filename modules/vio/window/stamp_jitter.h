#pragma once

// Estimates the jitter of the stamps of images, from the stamps alone. Stamps of the arrival of an
// image (in applications on phones and in browsers) jitter by some milliseconds, stamps of the
// exposure hardly at all. A change of frame rate or a lost image does not count as jitter.

#include <cstdint>
#include <deque>

namespace pangea::vio {

class StampJitter {
 public:
  void AddFrame(int64_t utime);
  // Standard deviation of a stamp; 0 if it is negligible or there are too few stamps.
  double sigma_s() const { return sigma_s_; }

 private:
  std::deque<int64_t> utimes_;
  double sigma_s_ = 0;
};

}  // namespace pangea::vio
