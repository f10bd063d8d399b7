#pragma once

// The agent's edits of anchors that the server has not answered yet. A state machine: monotonic
// microseconds go in; no clock, no bus; not thread safe. Bounds: kMaxEdits anchors, and a rate.

#include <cstdint>
#include <map>
#include <optional>

#include "core/anchor.h"
#include "link/anchor_wire.h"
#include "link/repeat_queue.h"

namespace pangea {

class EditQueue {
 public:
  static constexpr size_t kMaxEdits = 200;

  explicit EditQueue(double bytes_per_s) : queue_(bytes_per_s) {}

  enum class Taken { kNew, kOutdated, kFull };
  // Replaces a waiting older edit of the same anchor. If the newer edit does not move the anchor,
  // it takes over the older one's placement.
  Taken Add(AnchorEdit edit);
  // Whether this edit of the anchor, or a newer one, is waiting.
  bool Has(const AnchorId& anchor, int64_t revision) const;
  // The waiting edit of this anchor; there must be one.
  const AnchorEdit& Waiting(const AnchorId& anchor) const { return edits_.at(anchor); }
  // Removes the answered edit. False if no such edit was waiting.
  bool OnAnswer(const AnchorEditAnswer& answer);
  void OnNewSession() { queue_.SendAllAgain(); }
  // The edit that is due next, if any. After sending, call Charge with the size of its packet.
  std::optional<AnchorEdit> Next(int64_t now_us);
  void Charge(int64_t bytes_on_the_wire) { queue_.Charge(bytes_on_the_wire); }

  size_t waiting() const { return edits_.size(); }

 private:
  std::map<AnchorId, AnchorEdit> edits_;
  RepeatQueue queue_;
};

}  // namespace pangea
