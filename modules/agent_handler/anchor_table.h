#pragma once

// The anchors to send to one agent: of each the newest state, sent until the agent confirms it. A
// state machine: monotonic microseconds go in, bodies of packets come out; no clock, no bus; not
// thread safe. Bounds: kMaxAnchors, kAnchorBytesPerSecond.

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "link/anchor_wire.h"
#include "link/repeat_queue.h"

namespace pangea {

class AnchorTable {
 public:
  static constexpr size_t kMaxAnchors = 256;

  // `message`: the state as an encoded anchor_t. False if there is no room. Room is made by anchors
  // in other maps, which the agent has left, and by gone ones once the agent has confirmed that.
  bool Set(const AnchorState& state, std::vector<uint8_t> message);
  // In a new session, all anchors are sent again.
  void OnNewSession();
  void OnReceived(const std::vector<int64_t>& numbers);
  // The body that is due next, if any. After sending, call Charge with the size of its packet.
  std::optional<std::vector<uint8_t>> Next(int64_t now_us);
  void Charge(int64_t bytes_on_the_wire) { queue_.Charge(bytes_on_the_wire); }

  size_t size() const { return anchors_.size(); }
  size_t unconfirmed() const { return queue_.size(); }

 private:
  struct Entry {
    std::vector<uint8_t> message;
    MapId map;
    bool gone = false;
    int64_t number = 0;
  };
  bool MakeRoom(const MapId& map);

  std::map<AnchorId, Entry> anchors_;
  std::map<int64_t, AnchorId> unconfirmed_;  // by number
  RepeatQueue queue_{kAnchorBytesPerSecond};
  int64_t last_number_ = 0;
};

}  // namespace pangea
