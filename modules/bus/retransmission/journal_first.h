#pragma once

// A bus on which a server process that starts hears of the journal (JOURNAL_FILE, HAVE) before
// anything else: what
// others say meanwhile waits, in order. So a process that comes late knows that it does before the
// first message that would mislead it, and learns the maps in the journal's order.
//
// Without a HAVE for kLongest_us nobody owns a journal here, and all that waits is delivered. At
// most kMaxWaiting messages wait; later ones are dropped, as if the bus had lost them.

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
  static constexpr size_t kMaxWaiting = 2000;        // as a subscription of LcmBus

  // `now_utime`: wall clock.
  JournalFirstBus(Bus& bus, int64_t now_utime) : bus_(bus), begin_utime_(now_utime) {}

  void Publish(const std::string& channel, Bytes data) override { bus_.Publish(channel, data); }
  void Subscribe(const std::string& channel_regex, Handler handler) override;
  bool MoreWaits() override { return bus_.MoreWaits(); }
  Undelivered undelivered() override { return bus_.undelivered(); }
  void WorkWhenIdle(const std::function<bool()>& piece) override { bus_.WorkWhenIdle(piece); }
  // Delivers what waits if it is time to. Call it between the bus' messages.
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
