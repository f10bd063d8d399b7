#pragma once

// Publishes stored keyframes on an agent's bus in place of an odometry, to measure server and link
// without computing the keyframes again.
//   Out: KEYFRAME_k, STATUS_keyframes_k. In: HAVE, RESEND_REQUEST (answers on AGAIN_<requester>).

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "bus/process.h"
#include "bus/retransmission/reliable_keyframe_publisher.h"
#include "replay/keyframe_log.h"

namespace pangea {

struct KeyframePlayerOptions {
  int32_t agent_id = 0;
  // Recording seconds per second; 0 = as fast as the server keeps up.
  double rate = 1;
  std::optional<double> duration_s;  // of the recording; if empty, to its end
};

class KeyframePlayer : public Process {
 public:
  // An odometry makes a keyframe every 5 s at least, so this is one that paused or began anew: a
  // site's journal has days between its maps.
  static constexpr int64_t kLongestPause_us = 10'000'000;

  // `keyframes`: only those of this agent.
  KeyframePlayer(Bus& bus, const KeyframePlayerOptions& options,
                 std::vector<LoggedKeyframe> keyframes, int64_t now_utime);

  // Time of the next keyframe since the first one, sensor clock without what pauses are too long,
  // microseconds; empty at the end.
  std::optional<int64_t> next_us() const;
  // For people: how long it will take at rate 1.
  std::string Plan() const;
  void PlayNext();
  void Tick(int64_t now_utime) override;
  // Publishes the last status, with the counter finished = 1.
  void PublishFinished(int64_t now_utime);

  const ReliableKeyframePublisher& publisher() const { return publisher_; }

 private:
  KeyframePlayerOptions options_;
  std::vector<LoggedKeyframe> keyframes_;
  std::vector<int64_t> times_us_;
  Node node_;
  ReliableKeyframePublisher publisher_;
  size_t next_ = 0;
};

// Plays all keyframes at the given rate; then waits until all are acknowledged, or no
// acknowledgement can be expected.
void PlayKeyframes(LcmBus& bus, const KeyframePlayerOptions& options,
                   std::vector<LoggedKeyframe> keyframes);

}  // namespace pangea
