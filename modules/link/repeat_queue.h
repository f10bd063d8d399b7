#pragma once

// Decides which of many small messages, one for each anchor, is sent next. Messages that the other
// end has not confirmed are sent at once when they are new, then again every 300 ms, all together
// within a rate. The queue is first in, first out, and a sent message goes to its end; so no
// message waits for ever because others change often.
//
// A state machine: monotonic microseconds go in; no clock, no bus; not thread safe. The caller
// bounds the number of anchors.

#include <cstdint>
#include <map>
#include <optional>

#include "core/anchor.h"
#include "link/pacer.h"

namespace pangea {

class RepeatQueue {
 public:
  // `bytes_per_s`: largest rate, in bytes on the wire.
  explicit RepeatQueue(double bytes_per_s) : pacer_(bytes_per_s, kBurstBytes) {}

  // There is a new message for this anchor.
  void Add(const AnchorId& id);
  // The other end has confirmed the anchor's message.
  void Remove(const AnchorId& id);
  // In a new session, all messages become due, as if none had been sent.
  void SendAllAgain();

  // The anchor whose message is due next; it then counts as sent. Nothing if none is due or the
  // rate is used up. After sending, call Charge with the size of the message.
  std::optional<AnchorId> Next(int64_t now_us);
  void Charge(int64_t bytes_on_the_wire) { pacer_.Take(bytes_on_the_wire); }

  size_t size() const { return order_of_.size(); }

 private:
  static constexpr double kBurstBytes = 4000;
  struct Waiting {
    AnchorId id;
    std::optional<int64_t> sent_us;  // when the current message was last sent
  };

  Pacer pacer_;
  int64_t last_order_ = 0;
  std::map<int64_t, Waiting> by_order_;
  std::map<AnchorId, int64_t> order_of_;
};

}  // namespace pangea
