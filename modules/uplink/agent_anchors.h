#pragma once

// The anchors that an agent knows: the newest state of each from the server, and which states must
// still be confirmed to the server. A state machine: monotonic microseconds go in; no clock, no
// bus; not thread safe. Bound: kMaxAnchors.

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "link/anchor_wire.h"

namespace pangea {

class AgentAnchors {
 public:
  static constexpr size_t kMaxAnchors = 256;

  // If there is no room for this anchor, removes another one and returns it: a gone one, or else
  // one in another map, or one that the server has not sent in this session. Nothing if there is
  // room, or none can be removed.
  std::optional<AnchorState> MakeRoomFor(const AnchorState& state);

  enum class Taken { kNew, kKnown, kFull };
  // kNew: the caller must tell the apps. kFull: there is no room, and the state is not confirmed.
  Taken Take(const LinkAnchor& anchor, int64_t now_us);
  // In a new session, the server starts new numbers and sends all anchors again.
  void OnNewSession();
  // The numbers to confirm, one for each state received since the last call; at most
  // kMaxAnchorsReceived.
  std::vector<int64_t> TakeReceived() { return std::exchange(received_, {}); }
  // The anchors that the apps were last told of ten seconds ago or earlier; they count as told now.
  std::vector<AnchorState> DueAgain(int64_t now_us);

  size_t size() const { return anchors_.size(); }

 private:
  struct Entry {
    AnchorState state;
    int64_t number = 0;  // 0: from an earlier session
    int64_t told_us = 0;
  };
  std::map<AnchorId, Entry> anchors_;
  std::vector<int64_t> received_;
};

}  // namespace pangea
