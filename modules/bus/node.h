#pragma once

// What every process on the bus needs: typed subscriptions that drop malformed messages, counters,
// and the status message. A process class owns one Node and uses it on one thread.

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

// The counter of this name in a process' status; nothing if the status has none.
std::optional<int64_t> CounterOf(const status_t& status, std::string_view name);

class Node {
 public:
  // `name` is the process' name in STATUS_<name> and AGAIN_<name>, e.g. "fusion" or "vio_2".
  Node(Bus& bus, std::string name) : bus_(bus), name_(std::move(name)), heard_{&bus} {}

  const std::string& name() const { return name_; }
  Bus& bus() { return bus_; }

  // Calls handler(channel, message). Messages that do not decode are counted and dropped.
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

  // Calls handler(value) or handler(value, message); `value` is the domain type that Parse
  // (messages/messages.h) makes of the message. Messages that Parse refuses are counted and
  // dropped.
  template <typename Message, typename Handler>
  void Listen(std::string_view channel_regex, Handler handler) {
    Subscribe<Message>(std::string(channel_regex),
                       [this, handler = std::move(handler)](
                           const std::string&, const Message& message) { Take(message, handler); });
  }

  // Handles a given message as Listen does.
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

  // Calls handler(channel, bytes) without decoding, for channels that carry several types.
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

  // As Bus::WorkWhenIdle; the time of each piece is added to the handling times.
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

  // The status then also counts the undelivered messages of this second bus of the process.
  void Watch(Bus& bus) { heard_.push_back(&bus); }
  // Counts a refused message by its reason. At most 50 reasons are distinguished; the rest count as
  // "other reasons". The first message of each reason is logged (status_log.h).
  void Refuse(const std::string& reason);
  void Count(const std::string& counter, int64_t by = 1) { counters_[counter] += by; }
  void Set(const std::string& counter, int64_t value) { counters_[counter] = value; }
  void NoteDropped(int64_t count = 1) { dropped_ += count; }
  void NoteResendAsked() { ++resends_asked_; }

  // `pending`: number of items that wait for this process, 0 when idle. Status adds the process'
  // memory and CPU time.
  status_t Status(int64_t now_utime, int64_t pending, const std::string& summary) const;
  // True at the first call, then once a second.
  bool StatusIsDue(int64_t now_utime);
  void PublishStatus(int64_t now_utime, int64_t pending, const std::string& summary);

 private:
  static int64_t MonotonicNs();
  void NoteHandling(int64_t ns);

  Bus& bus_;
  std::string name_;
  std::vector<Bus*> heard_;
  StateChanges state_changes_;
  int64_t started_utime_ = 0;
  int64_t next_status_utime_ = 0;
  int64_t messages_in_ = 0;
  int64_t messages_out_ = 0;
  int64_t dropped_ = 0;
  int64_t resends_asked_ = 0;
  std::map<std::string, int64_t> refused_;
  std::map<std::string, int64_t> counters_;
  std::deque<float> handling_ms_;  // times of the newest 1000 messages and pieces of work
};

}  // namespace pangea
