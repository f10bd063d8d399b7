#include "uplink/ladder.h"

#include <algorithm>
#include <array>
#include <limits>

namespace pangea {
namespace {

// A full keyframe has about 100 tracked corners and 450 others, and 24 kB when compressed. A bare
// one has 1.5 kB.
constexpr std::array<LadderRung, RateLadder::kNumRungs> kRungs = {{
    {std::numeric_limits<int>::max(), 1},
    {300, 1},
    {150, 1},
    {50, 1},
    {50, 2},
    {50, 3},
    {0, 4},
}};

constexpr double kUp_s = 2;
constexpr int kHold = 6;  // keyframes
// Share of the budget for keyframes: packets add 5 %, poses another 5 %, and packets may be lost.
constexpr double kShare = 0.85;
// While more than this many seconds of budget are waiting (after a time without a link), new
// keyframes get a smaller share, so that the waiting ones are sent.
constexpr double kMuchWaiting_s = 10;
constexpr double kShareWhileMuchWaits = 0.6;

}  // namespace

const LadderRung& RateLadder::Rung(int rung) { return kRungs[static_cast<size_t>(rung)]; }

RateLadder::RateLadder(double budget_bytes_per_s) : budget_(budget_bytes_per_s) {}

RateLadder::Choice RateLadder::Next(int64_t now_us, int64_t waiting_bytes) {
  const bool much_waits = static_cast<double>(waiting_bytes) > kMuchWaiting_s * budget_;
  const double rate = budget_ * (much_waits ? kShareWhileMuchWaits : kShare);
  const double passed_s = last_us_ == 0 ? 0 : 1e-6 * static_cast<double>(now_us - last_us_);
  last_us_ = now_us;
  debt_bytes_ = std::max(0.0, debt_bytes_ - rate * passed_s);
  ++since_change_;
  const bool pays_off = since_change_ < Rung(rung_).every || debt_bytes_ < debt_at_change_;
  if (debt_bytes_ > kUp_s * rate && !pays_off && rung_ + 1 < kNumRungs) {
    Change(+1);
  } else if (debt_bytes_ == 0 && rung_ > 0 && since_change_ >= kHold) {
    Change(-1);
  }
  const bool bare = ++since_corners_ < Rung(rung_).every;
  since_corners_ = bare ? since_corners_ : 0;
  return {bare, Rung(rung_).untracked};
}

void RateLadder::Change(int by) {
  rung_ += by;
  since_change_ = 0;
  debt_at_change_ = debt_bytes_;
}

}  // namespace pangea
