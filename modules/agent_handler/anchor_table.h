#pragma once

// One agent's anchors on their way down: of each the newest state, sent until the agent says that
// it has it. A state machine: monotonic microseconds go in, bodies of packets come out; no clock,
// no bus, one thread. Bounds: kMaxAnchors, kAnchorBytesPerSecond.

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

  // `message`: an encoded anchor_t; `gone`: what it says. False if it is one too many: one that is
  // gone, and that the agent knows to be gone, makes room.
  bool Set(const AnchorId& id, bool gone, std::vector<uint8_t> message);
  // The agent knows nothing any more.
  void OnNewSession();
  void OnReceived(const std::vector<int64_t>& numbers);
  // The next body due, if one is; say with Charge what its packet took.
  std::optional<std::vector<uint8_t>> Next(int64_t now_us);
  void Charge(int64_t bytes_on_the_wire) { queue_.Charge(bytes_on_the_wire); }

  size_t size() const { return anchors_.size(); }
  size_t unconfirmed() const { return queue_.size(); }

 private:
  struct Entry {
    std::vector<uint8_t> message;
    bool gone = false;
    int64_t number = 0;
  };
  bool MakeRoom();

  std::map<AnchorId, Entry> anchors_;
  std::map<int64_t, AnchorId> unconfirmed_;  // by number
  RepeatQueue queue_{kAnchorBytesPerSecond};
  int64_t last_number_ = 0;
};

}  // namespace pangea
