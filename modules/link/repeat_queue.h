#pragma once

// Which of many small messages, one for each anchor, goes out next, of those that the other end has
// not confirmed: each at once when it is new, then again every 300 ms, all together within a rate.
// First come, first served, and what was sent goes to the end: none waits for ever because others
// change often.
//
// A state machine: monotonic microseconds go in; no clock, no bus, one thread. As large as what is
// in it.

#include <cstdint>
#include <map>
#include <optional>

#include "core/anchor.h"
#include "link/pacer.h"

namespace pangea {

class RepeatQueue {
 public:
  // `bytes_per_s`: on the wire.
  explicit RepeatQueue(double bytes_per_s) : pacer_(bytes_per_s, kBurstBytes) {}

  // The anchor has something new to say.
  void Add(const AnchorId& id);
  // The other end has it.
  void Remove(const AnchorId& id);
  // Another session: as if nothing had been sent.
  void SendAllAgain();

  // The next one due, which then counts as sent; nothing if none is, or the rate is used up. Say
  // with Charge what it took.
  std::optional<AnchorId> Next(int64_t now_us);
  void Charge(int64_t bytes_on_the_wire) { pacer_.Take(bytes_on_the_wire); }

  size_t size() const { return order_of_.size(); }

 private:
  static constexpr double kBurstBytes = 4000;
  struct Waiting {
    AnchorId id;
    std::optional<int64_t> sent_us;  // what it says now
  };

  Pacer pacer_;
  int64_t last_order_ = 0;
  std::map<int64_t, Waiting> by_order_;
  std::map<AnchorId, int64_t> order_of_;
};

}  // namespace pangea
