#pragma once

// A message bus like LCM's: it carries bytes on named channels. Implementations: LcmBus connects
// processes and is opened by URL. LocalBus stays in one process and one thread, first in first out,
// for tests and deterministic replay. Tests add their own.

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "core/bytes.h"
#include "messages/encoding.h"

namespace pangea {

class Bus {
 public:
  using Handler = std::function<void(const std::string& channel, Bytes data)>;

  virtual ~Bus() = default;
  virtual void Publish(const std::string& channel, Bytes data) = 0;
  // The handler gets each message whose whole channel name matches `channel_regex` (LCM's rule). A
  // subscription lasts as long as the bus.
  virtual void Subscribe(const std::string& channel_regex, Handler handler) = 0;
  // Counts of what arrived but reached no handler, since the bus was opened.
  struct Undelivered {
    std::map<std::string, int64_t> refused;  // datagrams that are not valid LCM, by reason
    int64_t no_room = 0;                     // messages that found the queue full
    int64_t by_kernel = 0;  // datagrams dropped by a full receive buffer or by the packet filter
  };
  virtual Undelivered undelivered() { return {}; }
  // Whether more messages are waiting. A handler can then postpone work that it would repeat for
  // each of them. False on a bus without a queue.
  virtual bool MoreWaits() { return false; }
  // Gives the bus long work to do while no message is waiting, so that the process still answers
  // messages. `piece` does a little of the work and returns whether some is left. Here, on a bus
  // without a queue, all of it is done at once. A bus has one such work: a new one replaces what is
  // left of the former.
  virtual void WorkWhenIdle(const std::function<bool()>& piece) {
    while (piece()) {
    }
  }
};

// Publish only queues a message. Drain delivers all queued messages, and those that the handlers
// publish meanwhile, until none is left.
class LocalBus : public Bus {
 public:
  LocalBus();
  ~LocalBus() override;
  void Publish(const std::string& channel, Bytes data) override;
  void Subscribe(const std::string& channel_regex, Handler handler) override;
  void Drain();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// The bus of all processes of one host, unless they are given another one. Many keyframes of 28 kB
// may come at once, and the kernel's default receive buffer would lose some of them.
inline constexpr char kDefaultBusUrl[] = "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=4194304";

// A bus opened by an LCM URL, e.g. kDefaultBusUrl. Where multicast is blocked, "tcpq://host:7700"
// connects to LCM's relay. The relay may stop and start at any time; messages published while it is
// away are lost, as on multicast. Subscribe and Handle must be called by one thread; Publish may be
// called by any thread.
class LcmBus : public Bus {
 public:
  // How multicast treats a message of several datagrams (above 65 kB). kRefused: the kernel drops
  // its fragments. The link uses this, because strangers can send there and we send no such
  // message.
  enum class Fragments : uint8_t { kJoined, kRefused };

  // Throws std::runtime_error, with the URL and advice, when the bus cannot be opened. An empty URL
  // stands for the environment's LCM_DEFAULT_URL, or else for LCM's default.
  explicit LcmBus(const std::string& url, Fragments fragments = Fragments::kJoined);
  ~LcmBus() override;
  void Publish(const std::string& channel, Bytes data) override;
  void Subscribe(const std::string& channel_regex, Handler handler) override;
  // Delivers waiting messages; waits for one at most `timeout_ms`. With work left (WorkWhenIdle) it
  // does not wait, but does a piece of work when there is no message, and after kMaxBeforeWork
  // messages in any case. Returns whether there was anything to do. Throws what a handler throws.
  bool Handle(int timeout_ms);
  bool MoreWaits() override;
  Undelivered undelivered() override;
  void WorkWhenIdle(const std::function<bool()>& piece) override;
  // File descriptor that is readable when Handle should be called. -1 while there is no connection
  // to the relay; Handle then tries to connect.
  int fd();

 private:
  static constexpr int kMaxBeforeWork = 200;

  struct Impl;
  struct Library;
  struct Multicast;
  struct Relayed;
  static std::unique_ptr<Impl> Open(const std::string& url, Fragments fragments);
  std::unique_ptr<Impl> impl_;
  std::function<bool()> work_;  // empty when none is left
  int handled_since_work_ = 0;
};

template <typename Message>
void PublishMessage(Bus& bus, const std::string& channel, const Message& message) {
  bus.Publish(channel, EncodeMessage(message));
}

}  // namespace pangea
