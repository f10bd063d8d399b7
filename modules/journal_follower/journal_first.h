#pragma once

// A bus that delivers the messages about the journal (JOURNAL_FILE, HAVE) first to a server process
// that starts. All other messages wait, in order, until a HAVE came. So a process that starts late
// knows this before the first other message, and learns the maps in the journal's order.
//
// If no HAVE comes for kLongest_us, there is no journal here, and all waiting messages are
// delivered. At most kMaxWaiting messages wait; later ones are dropped, as if the bus had lost
// them.

#include <cstdint>
#include <deque>
#include <functional>
#include <string>
#include <vector>

#include "bus/bus.h"

namespace pangea {

class JournalFirstBus : public Bus {
 public:
  static constexpr int64_t kLongest_us = 2'500'000;  // two HAVE intervals
  static constexpr size_t kMaxWaiting = 2000;        // the same as for a subscription of LcmBus

  // `now_utime`: wall clock.
  JournalFirstBus(Bus& bus, int64_t now_utime) : bus_(bus), begin_utime_(now_utime) {}

  void Publish(const std::string& channel, Bytes data) override { bus_.Publish(channel, data); }
  void Subscribe(const std::string& channel_regex, Handler handler) override;
  bool MoreWaits() override { return bus_.MoreWaits(); }
  Undelivered undelivered() override { return bus_.undelivered(); }
  void WorkWhenIdle(const std::function<bool()>& piece) override { bus_.WorkWhenIdle(piece); }
  // Delivers the waiting messages once a HAVE came or kLongest_us has passed. Call it between two
  // messages of the bus.
  void Poll(int64_t now_utime);

 private:
  struct Waiting {
    const Handler* handler;
    std::string channel;
    std::vector<uint8_t> data;
  };

  Bus& bus_;
  const int64_t begin_utime_;
  bool open_ = false;
  bool have_received_ = false;
  std::deque<Handler> handlers_;
  std::deque<Waiting> waiting_;
};

}  // namespace pangea
