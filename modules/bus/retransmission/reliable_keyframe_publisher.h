#pragma once

// Publishes an agent's keyframes on its bus: each once, and recent ones again on request.
//   Out: KEYFRAME_k. In: HAVE (which keyframes the server has acknowledged), and RESEND_REQUEST,
//   which is answered on AGAIN_<requester> from the newest `kept` keyframes; older ones are gone
//   and not answered. A request beyond the last keyframe of a map is answered with the first
//   keyframe kept of a later map, so that a requester that was away learns of the maps it missed.

#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <vector>

#include "bus/node.h"
#include "core/ids.h"
#include "messages/catch_up_messages.h"

namespace pangea {

class ReliableKeyframePublisher {
 public:
  static constexpr int kMaxAnswers = 30;  // keyframes per request; the rest needs another request

  // `now_utime`: wall clock.
  ReliableKeyframePublisher(Node& node, int32_t agent_id, size_t kept, int64_t now_utime);

  // `bytes`: an encoded keyframe_t of this agent.
  void Publish(const KeyframeId& id, std::vector<uint8_t> bytes);
  // Call it at about 10 Hz.
  void Tick(int64_t now_utime);

  // Number of keyframes published and not yet acknowledged, according to HAVE.
  int64_t Unacknowledged() const;
  // When the last HAVE came from the uplink, wall clock; before the first one, the start time.
  int64_t uplink_seen_utime() const { return uplink_seen_utime_; }
  bool uplink_ever_seen() const { return uplink_ever_seen_; }

 private:
  struct KeptKeyframe {
    KeyframeId id;
    std::vector<uint8_t> bytes;
  };

  void OnHave(const Have& have);
  void OnResendRequest(const ResendRequest& request);
  void Answer(const std::string& requester, const KeptKeyframe& keyframe);

  Node& node_;
  const int32_t agent_id_;
  const size_t max_kept_;
  std::deque<KeptKeyframe> kept_;
  std::map<MapId, int32_t> published_;     // number of keyframes of each map
  std::map<MapId, int32_t> acknowledged_;  // number of keyframes of each map
  int64_t uplink_seen_utime_ = 0;
  bool uplink_ever_seen_ = false;
  bool uplink_seen_ = false;  // since the last tick
};

}  // namespace pangea
