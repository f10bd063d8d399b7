#pragma once

// A token bucket: at most `bytes_per_s` on average, and about `burst_bytes` at once.

#include <algorithm>
#include <cstdint>

namespace pangea {

class Pacer {
 public:
  Pacer(double bytes_per_s, double burst_bytes)
      : rate_(bytes_per_s), burst_(burst_bytes), tokens_(burst_bytes) {}

  // `now_us` need not be monotonic: after a step back, the bucket is only not filled once.
  void Refill(int64_t now_us) {
    if (last_us_ != 0 && now_us > last_us_) {
      tokens_ = std::min(burst_, tokens_ + rate_ * 1e-6 * static_cast<double>(now_us - last_us_));
    }
    last_us_ = now_us;
  }
  // A message larger than the burst may be sent too: the bucket is then overdrawn.
  bool Ready() const { return tokens_ > 0; }
  void Take(int64_t bytes) { tokens_ -= static_cast<double>(bytes); }

 private:
  double rate_;
  double burst_;
  double tokens_;
  int64_t last_us_ = 0;
};

}  // namespace pangea
