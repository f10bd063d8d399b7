#pragma once

// Where an agent's keyframes come onto its bus: each is published once, and those of the newest
// that somebody missed again.
//   KEYFRAME_k out; HAVE (what the server has acknowledged) in; RESEND_REQUEST in, answered on
//   AGAIN_<requester> from the newest `kept` keyframes; older ones are gone and not answered. Who
//   asks for what comes after a map's last keyframe is told the first one of a later map, so that
//   an asker who was away learns of maps that came and went meanwhile.

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
  static constexpr int kMaxAnswers = 30;  // keyframes per request: the rest by another request

  // `now_utime`: wall clock.
  ReliableKeyframePublisher(Node& node, int32_t agent_id, size_t kept, int64_t now_utime);

  // An encoded keyframe_t of this agent.
  void Publish(const KeyframeId& id, std::vector<uint8_t> bytes);
  // At about 10 Hz.
  void Tick(int64_t now_utime);

  // Keyframes published and not yet acknowledged, as far as HAVE says.
  int64_t Unacknowledged() const;
  // When the uplink last spoke, wall clock; the start before it ever did.
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
  std::map<MapId, int32_t> published_;     // keyframes of each map
  std::map<MapId, int32_t> acknowledged_;  // of each map, how many
  int64_t uplink_seen_utime_ = 0;
  bool uplink_ever_seen_ = false;
  bool uplink_seen_ = false;  // since the last tick
};

}  // namespace pangea
