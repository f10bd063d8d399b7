#pragma once

// Anchors between the agents and the server: edits up into the journal, states down to the agents.
//   server bus: ANCHOR_REQUEST_0, ANCHOR_k in; ANCHOR_EDIT out (journal/anchor_edits.h)
// An edit is checked against what its editor's key allows as far as the edit alone tells: one who
// may edit its own only gives the anchor's maker. What is refused is answered too, so that it is
// not sent for ever.

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "agent_handler/anchor_table.h"
#include "agent_handler/journal/archive.h"
#include "bus/node.h"
#include "link/link_session.h"

namespace pangea {

class AnchorRelay {
 public:
  static constexpr size_t kMaxFromTools = 200;
  // Seals and sends a packet; its bytes on the wire.
  using Send = std::function<int64_t(LinkKind kind, std::vector<uint8_t> body)>;

  AnchorRelay(Node& node, Archive& archive);

  // Those that have a key, and what it allows; others are forgotten.
  void SetRights(const std::map<int32_t, AnchorRight>& rights);
  static bool IsOfAnchors(LinkKind kind) {
    return kind == LinkKind::kAnchorEdit || kind == LinkKind::kAnchorsReceived;
  }
  // Why it is refused, or an empty string.
  std::string OnPacket(int32_t agent_id, const LinkPacket& packet);
  void OnNewSession(int32_t agent_id);
  // After the journal was synced.
  void OnJournalled(const std::vector<AnchorEdit>& edits);
  void Poll();
  // What is due to the agent.
  void SendDue(int32_t agent_id, int64_t now_us, const Send& send);
  void SetCounters();

 private:
  struct Agent {
    AnchorRight right = AnchorRight::kUnknown;
    AnchorTable table;
    std::vector<AnchorEditAnswer> answers;  // not yet sent; at most kMaxAnchorEditAnswers
  };
  void OnAnchor(const std::string& channel, const anchor_t& message);
  void OnEdit(int32_t agent_id, Agent* agent, AnchorEdit edit);
  static void Answer(Agent* agent, const AnchorEdit& edit, bool journalled);
  bool TakeFromTool(const AnchorEdit& edit);

  Node& node_;
  Archive& archive_;
  std::map<int32_t, Agent> agents_;
  std::deque<AnchorEdit> from_tools_;  // while the disk is behind
};

}  // namespace pangea
