#pragma once

// The agent's edits of anchors until the journal has them. A state machine: monotonic microseconds
// go in; no clock, no bus, one thread. Bounds: kMaxEdits anchors, and a rate.

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
  // In place of an older edit of the anchor: the newer stands for both, also for where the older
  // put it, if the newer leaves it there.
  Taken Add(AnchorEdit edit);
  // This edit of the anchor, or a newer one.
  bool Has(const AnchorId& anchor, int64_t revision) const;
  // The one that waits of this anchor; there must be one.
  const AnchorEdit& Waiting(const AnchorId& anchor) const { return edits_.at(anchor); }
  // Whether it was waiting for it.
  bool OnAnswer(const AnchorEditAnswer& answer);
  void OnNewSession() { queue_.SendAllAgain(); }
  // The next one due, if one is; say with Charge what its packet took.
  std::optional<AnchorEdit> Next(int64_t now_us);
  void Charge(int64_t bytes_on_the_wire) { queue_.Charge(bytes_on_the_wire); }

  size_t waiting() const { return edits_.size(); }

 private:
  std::map<AnchorId, AnchorEdit> edits_;
  RepeatQueue queue_;
};

}  // namespace pangea
