#include "bus/retransmission/playback_pace.h"

#include <algorithm>
#include <chrono>
#include <thread>

namespace pangea {
namespace {

constexpr int64_t kTickInterval_us = 100'000;
constexpr int64_t kLastWait_us = 20'000'000;
constexpr int64_t kLastWaitAlone_us = 1'000'000;

}  // namespace

void PlaybackPace::Serve(int timeout_ms) {
  if (bus_ != nullptr) {
    while (bus_->Handle(timeout_ms)) {
      timeout_ms = 0;
    }
  } else if (timeout_ms > 0) {
    std::this_thread::sleep_for(std::chrono::milliseconds(timeout_ms));
  }
  const int64_t now = WallUtime();
  if (now >= next_tick_utime_) {
    process_.Tick(now);
    next_tick_utime_ = now + kTickInterval_us;
  }
}

void PlaybackPace::WaitUntil(int64_t wall_utime) {
  for (int64_t now = WallUtime(); now < wall_utime && !StopRequested(); now = WallUtime()) {
    Serve(static_cast<int>(std::clamp<int64_t>((wall_utime - now) / 1000, 1, 50)));
  }
}

void PlaybackPace::WaitForAcknowledgements() {
  int64_t unacknowledged = publisher_.Unacknowledged();
  int64_t progress_utime = WallUtime();
  while (bus_ != nullptr && !StopRequested() && publisher_.Unacknowledged() > kMaxAhead &&
         WallUtime() - publisher_.uplink_seen_utime() < kUplinkSilence_us &&
         WallUtime() - progress_utime < kNoProgress_us) {
    Serve(50);
    if (publisher_.Unacknowledged() < unacknowledged) {
      unacknowledged = publisher_.Unacknowledged();
      progress_utime = WallUtime();
    }
  }
}

void PlaybackPace::WaitAtTheEnd() {
  const int64_t begin = WallUtime();
  while (bus_ != nullptr && publisher_.Unacknowledged() > 0 && !StopRequested() &&
         WallUtime() - begin < (publisher_.uplink_ever_seen() ? kLastWait_us : kLastWaitAlone_us)) {
    Serve(50);
  }
}

}  // namespace pangea
