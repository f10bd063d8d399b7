#pragma once

// Lets a process that plays a recording onto an agent's bus wait: until the next item is due, or
// until the server has caught up. Meanwhile it handles messages and ticks.

#include <cstdint>

#include "bus/process.h"
#include "bus/retransmission/reliable_keyframe_publisher.h"

namespace pangea {

class PlaybackPace {
 public:
  static constexpr int64_t kMaxAhead = 30;  // unacknowledged keyframes
  static constexpr int64_t kUplinkSilence_us = 5'000'000;
  // If the uplink runs but makes no progress for this long, it reaches no server; an agent does not
  // wait for one.
  static constexpr int64_t kNoProgress_us = 20'000'000;

  // `bus` may be null; then no messages are handled.
  PlaybackPace(LcmBus* bus, Process& process, const ReliableKeyframePublisher& publisher)
      : bus_(bus), process_(process), publisher_(publisher) {}

  // Handles the messages that have arrived. Waits for the first one at most `timeout_ms`.
  void Serve(int timeout_ms);
  void WaitUntil(int64_t wall_utime);
  // Waits until at most kMaxAhead keyframes are unacknowledged, but only while there is an uplink
  // that makes progress.
  void WaitForAcknowledgements();
  // Waits until every keyframe is acknowledged, at most 20 s; at most 1 s if no uplink was ever
  // seen.
  void WaitAtTheEnd();

 private:
  LcmBus* bus_;
  Process& process_;
  const ReliableKeyframePublisher& publisher_;
  int64_t next_tick_utime_ = 0;
};

}  // namespace pangea
