#pragma once

// Anchors between the agent's bus and the link.
//   agent bus: ANCHOR_REQUEST_k in; ANCHOR_k, SHOWN_ANCHORS_k out

#include <cstdint>
#include <functional>
#include <vector>

#include "bus/node.h"
#include "link/link_session.h"
#include "uplink/agent_anchors.h"
#include "uplink/edit_queue.h"
#include "uplink/shown_anchors.h"

namespace pangea {

class UplinkAnchors {
 public:
  // Seals and sends a packet; its bytes on the wire.
  using Send = std::function<int64_t(LinkKind kind, std::vector<uint8_t> body)>;

  // `edit_bytes_per_s`: for edits on their way up, at most.
  UplinkAnchors(Node& node, int32_t agent_id, double edit_bytes_per_s);

  static bool IsOfAnchors(LinkKind kind) {
    return kind == LinkKind::kAnchor || kind == LinkKind::kAnchorEditAnswers;
  }
  void OnPacket(const LinkPacket& packet, int64_t now_us);
  void OnNewSession();
  void OnPose(int64_t utime, const MapId& map) { shown_.OnPose(utime, map); }
  void OnKeyframe(int64_t utime, const MapId& map) { shown_.OnKeyframe(utime, map); }
  // What is due to the server; only in a session.
  void SendDue(int64_t now_us, const Send& send);
  // What is due on the agent's bus.
  void Publish(int64_t now_us);
  // Publish wants to be called every few milliseconds.
  bool moving() const { return shown_.moving(); }
  size_t edits_waiting() const { return edits_.waiting(); }

 private:
  void OnRequest(AnchorEdit edit);
  void OnAnchor(Bytes body, int64_t now_us);
  void OnEditAnswers(Bytes body);
  void Tell(const AnchorState& state);

  Node& node_;
  const int32_t agent_id_;
  EditQueue edits_;
  AgentAnchors anchors_;
  ShownAnchorsBlend shown_;
};

}  // namespace pangea
