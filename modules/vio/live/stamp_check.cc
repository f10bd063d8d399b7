#include "vio/live/stamp_check.h"

namespace pangea::vio {

StampCheck::Decision StampCheck::Check(int64_t utime) {
  if (utime > kMaxUtime || utime < -kMaxUtime) {
    return Decision::kOutOfRange;
  }
  const bool is_after = !newest_ || utime > *newest_;
  const bool is_next = is_after && (!newest_ || utime - *newest_ <= max_step_us_);
  if (!is_next && !Agrees(utime)) {
    return is_after ? Decision::kFarAhead : Decision::kNotAfter;
  }
  newest_ = utime;
  refused_ = 0;
  return is_after ? Decision::kNext : Decision::kWentBack;
}

// A repeat of the last refused stamp (a bus may deliver a message twice) does not count.
bool StampCheck::Agrees(int64_t utime) {
  if (refused_ > 0 && utime == last_refused_) {
    return false;
  }
  if (refused_ == 0 || utime < last_refused_ || utime - last_refused_ > max_step_us_) {
    refused_ = 0;
    first_refused_ = utime;
  }
  last_refused_ = utime;
  return ++refused_ >= kAgreeing && utime - first_refused_ > max_step_us_;
}

}  // namespace pangea::vio
