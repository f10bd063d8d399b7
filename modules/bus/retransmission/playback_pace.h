#pragma once

// The waiting of a process that plays something recorded onto an agent's bus: until it is time for
// the next item, or until the server keeps up; the bus is served meanwhile.

#include <cstdint>

#include "bus/process.h"
#include "bus/retransmission/reliable_keyframe_publisher.h"

namespace pangea {

class PlaybackPace {
 public:
  static constexpr int64_t kMaxAhead = 30;  // unacknowledged keyframes
  static constexpr int64_t kUplinkSilence_us = 5'000'000;
  // An uplink that is there but makes no progress for this long has no server behind it, and an
  // agent does not wait for a server.
  static constexpr int64_t kNoProgress_us = 20'000'000;

  // `bus` may be null: nothing to listen to.
  PlaybackPace(LcmBus* bus, Process& process, const ReliableKeyframePublisher& publisher)
      : bus_(bus), process_(process), publisher_(publisher) {}

  // Handles what has arrived, waiting for the first message at most `timeout_ms`.
  void Serve(int timeout_ms);
  void WaitUntil(int64_t wall_utime);
  // While there is an uplink that makes progress: until no more than kMaxAhead are unacknowledged.
  void WaitForAcknowledgements();
  // Until every keyframe is acknowledged, or nobody will.
  void WaitAtTheEnd();

 private:
  LcmBus* bus_;
  Process& process_;
  const ReliableKeyframePublisher& publisher_;
  int64_t next_tick_utime_ = 0;
};

}  // namespace pangea
