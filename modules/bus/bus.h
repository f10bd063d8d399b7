#pragma once

// A message bus, as thin as LCM's: channels of bytes. Three implementations: LcmBus (a real one, by
// URL), LocalBus (in one process, one thread, first in first out: tests and deterministic replay),
// and whatever a test needs.

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace pangea {

using Bytes = std::span<const uint8_t>;

class Bus {
 public:
  using Handler = std::function<void(const std::string& channel, Bytes data)>;

  virtual ~Bus() = default;
  virtual void Publish(const std::string& channel, Bytes data) = 0;
  // `channel_regex` is anchored at both ends (LCM's rule). Lasts as long as the bus.
  virtual void Subscribe(const std::string& channel_regex, Handler handler) = 0;
  // What came and reached nobody who wants it, since the bus was opened.
  struct Undelivered {
    std::map<std::string, int64_t> refused;  // was no message of LCM's, by reason
    int64_t no_room = 0;                     // messages that came while too many waited
    int64_t by_kernel = 0;  // datagrams: there was no room, or the bus' filter kept them out
  };
  virtual Undelivered undelivered() { return {}; }
  // Whether more messages wait already, so that work which they share may wait for them. A bus that
  // has each message handled to completion says no.
  virtual bool MoreWaits() { return false; }
  // Work that messages brought and that is to wait until no message does, so that whoever works
  // long still hears and answers: `piece` does a little of it, and says whether some is left. A bus
  // that has each message handled to completion has all of it done at once. One work for each bus:
  // what is given while some is left replaces it.
  virtual void WorkWhenIdle(const std::function<bool()>& piece) {
    while (piece()) {
    }
  }
};

// Publish queues; Drain delivers, including what the handlers publish, until nothing is left.
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

// Where processes of one host meet unless they are told otherwise. A keyframe is 28 kB, and many
// come at once: the kernel's own receive buffer would lose some.
inline constexpr char kDefaultBusUrl[] = "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=4194304";

// A bus by LCM URL, e.g. kDefaultBusUrl, or
// "tcpq://host:7700" where multicast is blocked: LCM's relay, which may come and go, and stop; what
// is published meanwhile is lost, as on multicast. Subscribe and Handle are for one thread; Publish
// may be called from any.
class LcmBus : public Bus {
 public:
  // What becomes of a message in several datagrams (above 65 kB) on multicast. Where strangers can
  // speak and nobody of ours sends such a one, as on the link, the kernel drops its fragments.
  enum class Fragments : uint8_t { kJoined, kRefused };

  // Throws std::runtime_error naming the URL and the likely mend when it cannot be opened. No URL:
  // LCM_DEFAULT_URL of the environment, or LCM's own default, as with all of LCM.
  explicit LcmBus(const std::string& url, Fragments fragments = Fragments::kJoined);
  ~LcmBus() override;
  void Publish(const std::string& channel, Bytes data) override;
  void Subscribe(const std::string& channel_regex, Handler handler) override;
  // Delivers what is waiting, at most for `timeout_ms`, or does a piece of work if nothing is
  // (after kMaxBeforeWork messages in a row one anyway); returns whether there was anything to do.
  // An exception from a handler comes out here.
  bool Handle(int timeout_ms);
  bool MoreWaits() override;
  Undelivered undelivered() override;
  void WorkWhenIdle(const std::function<bool()>& piece) override;
  // File descriptor to poll on; -1 while there is no connection to a relay, and Handle looks for
  // one.
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

// Encodes an lcm-gen type.
template <typename Message>
std::vector<uint8_t> EncodeMessage(const Message& message) {
  std::vector<uint8_t> bytes(static_cast<size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

template <typename Message>
void PublishMessage(Bus& bus, const std::string& channel, const Message& message) {
  bus.Publish(channel, EncodeMessage(message));
}

// Decodes an lcm-gen type; false on a wrong fingerprint, a short or long payload, or absurd counts.
// (LCM's own typed subscriptions abort the process on these.)
template <typename Message>
bool DecodeMessage(Bytes data, Message* message) {
  try {
    *message = Message{};
    return message->decode(data.data(), 0, static_cast<int>(data.size())) ==
           static_cast<int>(data.size());
  } catch (const std::exception&) {
    return false;
  }
}

}  // namespace pangea
