#pragma once

// Checks that each stamp of a live stream continues the stream. A stamp far ahead of the last one
// is refused: if it were accepted, all following stamps would lie before it. But the last accepted
// stamp may be the wrong one, or the sensor's clock may have been set: so kAgreeing refused stamps
// in a row that continue each other, over more than `max_step_us`, become the stream from then on.
// No clock: only stamps are compared.

#include <cstdint>
#include <optional>

namespace pangea::vio {

class StampCheck {
 public:
  static constexpr int kAgreeing = 5;
  // Largest int64 nanoseconds (as in EuRoC's files) in microseconds, the year 2262: sums and
  // differences of such stamps do not overflow.
  static constexpr int64_t kMaxUtime = 9'223'372'036'854'775;

  enum class Decision {
    kNext,
    kWentBack,  // accepted: the stream continues at this earlier time
    kNotAfter,  // refused, like all below
    kFarAhead,
    kOutOfRange
  };

  // `max_step_us`: the longest gap that the stream's user can bridge.
  explicit StampCheck(int64_t max_step_us) : max_step_us_(max_step_us) {}

  Decision Check(int64_t utime);
  // The last accepted stamp.
  const std::optional<int64_t>& newest() const { return newest_; }

 private:
  bool Agrees(int64_t utime);

  int64_t max_step_us_;
  std::optional<int64_t> newest_;
  // Of the refused stamps that continue each other; an accepted stamp resets the count.
  int refused_ = 0;
  int64_t first_refused_ = 0;
  int64_t last_refused_ = 0;
};

}  // namespace pangea::vio
