#pragma once

// What every process on the bus needs once: typed subscriptions that survive bad bytes, counting,
// and the 1 Hz status message. A process class owns a Node and is otherwise plain code.

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "bus/bus.h"
#include "bus/status_log.h"
#include "pangea/status_t.hpp"

namespace pangea {

// A counter of what a process said of itself; nothing if it has none of this name.
std::optional<int64_t> CounterOf(const status_t& status, std::string_view name);

class Node {
 public:
  // `name` is the process' name in STATUS_<name> and AGAIN_<name>, e.g. "fusion" or "vio_2".
  Node(Bus& bus, std::string name) : bus_(bus), name_(std::move(name)), heard_{&bus} {}

  const std::string& name() const { return name_; }
  Bus& bus() { return bus_; }

  // handler(channel, message). What does not decode is counted and dropped.
  template <typename Message, typename Handler>
  void Subscribe(const std::string& channel_regex, Handler handler) {
    SubscribeBytes(channel_regex,
                   [this, handler = std::move(handler)](const std::string& channel, Bytes data) {
                     Message message{};
                     if (DecodeMessage(data, &message)) {
                       handler(channel, message);
                     } else {
                       Refuse(std::string(Message::getTypeName()) + " does not decode");
                     }
                   });
  }

  // handler(value) or handler(value, message), with what messages.h' Parse makes of it. What it
  // refuses is counted and dropped.
  template <typename Message, typename Handler>
  void Listen(std::string_view channel_regex, Handler handler) {
    Subscribe<Message>(std::string(channel_regex),
                       [this, handler = std::move(handler)](
                           const std::string&, const Message& message) { Take(message, handler); });
  }

  // The same, of a message at hand.
  template <typename Message, typename Handler>
  void Take(const Message& message, const Handler& handler) {
    auto parsed = Parse(message);
    if (!parsed.value) {
      Refuse(parsed.refused);
    } else if constexpr (std::is_invocable_v<Handler, decltype(*std::move(parsed.value)),
                                             const Message&>) {
      handler(*std::move(parsed.value), message);
    } else {
      handler(*std::move(parsed.value));
    }
  }

  // handler(channel, bytes), for several types at once.
  template <typename Handler>
  void SubscribeBytes(const std::string& channel_regex, Handler handler) {
    bus_.Subscribe(channel_regex,
                   [this, handler = std::move(handler)](const std::string& channel, Bytes data) {
                     ++messages_in_;
                     const int64_t begin_ns = MonotonicNs();
                     handler(channel, data);
                     NoteHandling(MonotonicNs() - begin_ns);
                   });
  }

  // Bus::WorkWhenIdle; each piece is counted among the handling times.
  template <typename Piece>
  void WorkWhenIdle(Piece piece) {
    bus_.WorkWhenIdle([this, piece = std::move(piece)] {
      const int64_t begin_ns = MonotonicNs();
      const bool more = piece();
      NoteHandling(MonotonicNs() - begin_ns);
      return more;
    });
  }

  template <typename Message>
  void Publish(const std::string& channel, const Message& message) {
    ++messages_out_;
    PublishMessage(bus_, channel, message);
  }

  // What another bus of this process keeps from it is told in the status too.
  void Watch(Bus& bus) { heard_.push_back(&bus); }
  // Counts a refused message by its reason; at most 50 distinct reasons are told apart, and the
  // first of each is logged (status_log.h).
  void Refuse(const std::string& reason);
  void Count(const std::string& counter, int64_t by = 1) { counters_[counter] += by; }
  void Set(const std::string& counter, int64_t value) { counters_[counter] = value; }
  void NoteDropped(int64_t count = 1) { dropped_ += count; }
  void NoteResendAsked() { ++resends_asked_; }

  // `pending`: work waiting, 0 when idle. Measures process memory and CPU itself.
  status_t Status(int64_t now_utime, int64_t pending, const std::string& summary) const;
  void PublishStatus(int64_t now_utime, int64_t pending, const std::string& summary);

 private:
  static int64_t MonotonicNs();
  void NoteHandling(int64_t ns);

  Bus& bus_;
  std::string name_;
  std::vector<Bus*> heard_;
  StateChanges state_changes_;
  int64_t started_utime_ = 0;
  int64_t messages_in_ = 0;
  int64_t messages_out_ = 0;
  int64_t dropped_ = 0;
  int64_t resends_asked_ = 0;
  std::map<std::string, int64_t> refused_;
  std::map<std::string, int64_t> counters_;
  std::deque<float> handling_ms_;  // of the newest 1000 messages and pieces of work
};

}  // namespace pangea
