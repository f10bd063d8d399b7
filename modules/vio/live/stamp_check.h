#pragma once

// Whether the stamps of a live stream go on from one another. One that is far ahead of the last is
// refused: taken, it would stand before all that follow. But the last may be the one that was
// wrong, or the sensor's clock may have been set: kAgreeing stamps in a row, over more than
// `max_step_us`, that go on from one another are the stream from then on. No clock: only stamps are
// compared.

#include <cstdint>
#include <optional>

namespace pangea::vio {

class StampCheck {
 public:
  static constexpr int kAgreeing = 5;
  // The microseconds that nanoseconds can count, as EuRoC's files do (the year 2262): sums and
  // differences of such stamps do not overflow.
  static constexpr int64_t kMaxUtime = 9'223'372'036'854'775;

  enum class Decision {
    kNext,
    kWentBack,  // the stream goes on from here, and here is not after what was taken before
    kNotAfter,  // refused, as all below
    kFarAhead,
    kOutOfRange
  };

  // `max_step_us`: the longest hole that whoever takes the stream could bridge.
  explicit StampCheck(int64_t max_step_us) : max_step_us_(max_step_us) {}

  Decision Check(int64_t utime);
  // The last that was taken.
  const std::optional<int64_t>& newest() const { return newest_; }

 private:
  bool Agrees(int64_t utime);

  int64_t max_step_us_;
  std::optional<int64_t> newest_;
  // Of the refused ones that go on from one another; anything taken ends them.
  int refused_ = 0;
  int64_t first_refused_ = 0;
  int64_t last_refused_ = 0;
};

}  // namespace pangea::vio
