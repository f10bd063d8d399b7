#pragma once

// What an agent knows of anchors: of each the newest state that the server has sent, and what of it
// has still to be confirmed. A state machine: monotonic microseconds go in; no clock, no bus, one
// thread. Bound: kMaxAnchors.

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "link/anchor_wire.h"

namespace pangea {

class AgentAnchors {
 public:
  static constexpr size_t kMaxAnchors = 256;

  // If another anchor finds no room: the one that goes for it, if one may: one that is gone, or
  // else one that this session has not spoken of.
  std::optional<AnchorState> MakeRoomFor(const AnchorId& id);

  enum class Taken { kNew, kKnown, kFull };
  // kNew: tell the apps.
  Taken Take(const LinkAnchor& anchor, int64_t now_us);
  // The server numbers anew, and sends all anew.
  void OnNewSession();
  // Numbers to confirm, each once for each time that it came; at most kMaxAnchorsReceived.
  std::vector<int64_t> TakeReceived() { return std::exchange(received_, {}); }
  // What the apps were last told of ten seconds ago.
  std::vector<AnchorState> DueAgain(int64_t now_us);

  size_t size() const { return anchors_.size(); }

 private:
  struct Entry {
    AnchorState state;
    int64_t number = 0;  // 0: of an earlier session
    int64_t told_us = 0;
  };
  std::map<AnchorId, Entry> anchors_;
  std::vector<int64_t> received_;
};

}  // namespace pangea
