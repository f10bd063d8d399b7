#pragma once

// Relays anchors and edits of anchors between the agent's bus and the link.
//   agent bus: ANCHOR_REQUEST_k in; ANCHOR_k, SHOWN_ANCHORS_k out

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <vector>

#include "bus/node.h"
#include "link/link_session.h"
#include "uplink/agent_anchors.h"
#include "uplink/edit_queue.h"
#include "uplink/edit_store.h"
#include "uplink/pose_history.h"
#include "uplink/shown_anchors.h"

namespace pangea {

class UplinkAnchors {
 public:
  // Seals and sends a packet; returns its bytes on the wire.
  using Send = std::function<int64_t(LinkKind kind, std::vector<uint8_t> body)>;

  // `edit_bytes_per_s`: largest rate for edits to the server. `spool` may be null.
  UplinkAnchors(Node& node, int32_t agent_id, double edit_bytes_per_s, EditStore* spool = nullptr);

  static bool IsOfAnchors(LinkKind kind) {
    return kind == LinkKind::kAnchor || kind == LinkKind::kAnchorEditAnswers;
  }
  void OnPacket(const LinkPacket& packet, int64_t now_us);
  void OnNewSession();
  // `T_odom_body`: nothing while the odometry does not track.
  void OnPose(int64_t utime, const MapId& map, const std::optional<Rigid3>& T_odom_body);
  void OnKeyframe(int64_t utime, const MapId& map, const Rigid3& T_odom_body);
  // Sends what is due to the server. Only in a session.
  void SendDue(int64_t now_us, const Send& send);
  // Publishes what is due on the agent's bus.
  void Publish(int64_t now_us);
  // If true, Publish must be called every few milliseconds.
  bool moving() const { return shown_.moving(); }
  size_t edits_waiting() const { return edits_.waiting() + held_.size(); }
  void SyncSpool() {
    if (spool_ != nullptr) {
      spool_->Sync();
    }
  }
  // Whether the last edit could not be stored, so that it would not survive this process.
  bool spool_refuses() const { return spool_ != nullptr && spool_->refuses(); }

 private:
  // An edit relative to the agent's pose at some time. It is held until the next keyframe after
  // that time makes that pose more accurate.
  struct Held {
    AnchorEdit edit;
    int64_t until_us = 0;
  };

  void OnRequest(AnchorEdit edit);
  void Hold(AnchorEdit edit);
  void Queue(AnchorEdit edit);
  void Release(const AnchorId& id);
  void ReleaseSettled();
  void OnAnchor(Bytes body, int64_t now_us);
  void OnEditAnswers(Bytes body);
  void Tell(const AnchorState& state);

  Node& node_;
  const int32_t agent_id_;
  EditStore* const spool_;
  int64_t now_us_ = 0;
  std::map<AnchorId, Held> held_;  // at most EditQueue::kMaxEdits
  EditQueue edits_;
  AgentAnchors anchors_;
  ShownAnchorsBlend shown_;
  PoseHistory poses_;
};

}  // namespace pangea
