#pragma once

// Relays anchors between the agents and the server: edits go up into the journal, states go down to
// the agents.
//   server bus: ANCHOR_REQUEST_0, ANCHOR_k in; ANCHOR_EDIT out (journal/anchor_edits.h)
// An edit must name its anchor, and is checked against the right of its editor's key, as far as the
// edit alone tells: with kEditOwn, the editor must be the maker in the anchor's id. Refused edits
// are answered too, so that the agent stops sending them.

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
  // Seals and sends a packet; returns its bytes on the wire.
  using Send = std::function<int64_t(LinkKind kind, std::vector<uint8_t> body)>;

  AnchorRelay(Node& node, Archive& archive);

  // The agents that have a key, with the right that it gives. Other agents are forgotten.
  void SetRights(const std::map<int32_t, AnchorRight>& rights);
  static bool IsOfAnchors(LinkKind kind) {
    return kind == LinkKind::kAnchorEdit || kind == LinkKind::kAnchorsReceived;
  }
  // Returns why the packet is refused, or an empty string.
  std::string OnPacket(int32_t agent_id, const LinkPacket& packet);
  void OnNewSession(int32_t agent_id);
  // These edits are kept now (Archive::TakeJournalledEdits): their editors are answered.
  void OnJournalled(const std::vector<AnchorEdit>& edits);
  void Poll();
  // Sends what is due to the agent.
  void SendDue(int32_t agent_id, int64_t now_us, const Send& send);
  void SetCounters();

 private:
  struct Agent {
    AnchorRight right = AnchorRight::kUnknown;
    AnchorTable table;
    std::vector<AnchorEditAnswer> answers;  // to be sent; at most kMaxAnchorEditAnswers
  };
  void OnAnchor(const std::string& channel, const anchor_t& message);
  void OnEdit(int32_t agent_id, Agent* agent, AnchorEdit edit);
  static void Answer(Agent* agent, const AnchorEdit& edit, bool journalled);
  bool TakeFromTool(const AnchorEdit& edit);

  Node& node_;
  Archive& archive_;
  std::map<int32_t, Agent> agents_;
  std::deque<AnchorEdit> from_tools_;  // edits by tools that wait for the disk
};

}  // namespace pangea
