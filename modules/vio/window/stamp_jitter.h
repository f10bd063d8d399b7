#pragma once

// How far the stamps of images jitter, by themselves: those that are taken when an image arrives
// (in phones' and browsers' applications) by some milliseconds, those of the exposure by next to
// none. A frame rate that changes, or a lost image, is no jitter.

#include <cstdint>
#include <deque>

namespace pangea::vio {

class StampJitter {
 public:
  void AddFrame(int64_t utime);
  // Standard deviation of a stamp; 0 when it is too small to matter, or too few have come.
  double sigma_s() const { return sigma_s_; }

 private:
  std::deque<int64_t> utimes_;
  double sigma_s_ = 0;
};

}  // namespace pangea::vio
