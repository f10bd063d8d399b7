#pragma once

// A connection to LCM's TCP relay (tcpq://host:port; `java -cp lcm.jar lcm.lcm.TCPService PORT`)
// that never blocks and never gives up: for networks without multicast. LCM's own waits for ever in
// a read or write when the relay is stopped, and aborts when it is gone; so the protocol, three
// kinds of message, is spoken here.
//
// What is published while there is no relay, or more than kMaxUnsent bytes behind it, is dropped,
// as multicast would; who needs it requests it. One thread, but Publish from any.

#include <netinet/in.h>

#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "bus/bus.h"
#include "bus/subscriptions.h"

namespace pangea {

class TcpqConnection {
 public:
  static constexpr size_t kMaxUnsent = 4 << 20;
  static constexpr size_t kMaxMessage = 1 << 20;  // a larger one is no message of ours
  static constexpr int64_t kRetry_us = 500'000;
  // A relay that does not answer for so long is complained of: in one line, on stderr, and in
  // another one when it is there.
  static constexpr int64_t kPatience_us = 2'000'000;
  // A connection that is not made in this time is tried anew; the kernel would wait ever longer.
  static constexpr int64_t kConnecting_us = 5'000'000;

  // Throws std::runtime_error if the address makes no sense. The relay need not be there yet.
  explicit TcpqConnection(const std::string& url);
  ~TcpqConnection();
  TcpqConnection(const TcpqConnection&) = delete;
  TcpqConnection& operator=(const TcpqConnection&) = delete;

  void Publish(const std::string& channel, Bytes data);
  void Subscribe(const std::string& channel_regex, Bus::Handler handler);
  // Connects if need be and sends what waits; delivers one message, waiting for it at most so long.
  bool Handle(int timeout_ms);
  // Whether Handle would deliver one at once.
  bool MoreWaits();
  // -1 while there is no connection.
  int fd();

 private:
  enum class State : uint8_t { kAway, kConnecting, kConnected };
  // Where the first whole message lies in received_.
  struct Frame {
    std::string channel;
    Bytes data;
    size_t end = 0;
  };

  void Connect();
  void OnConnected();
  void OnGreeted();
  void Disconnect(const char* why);
  void CheckPatience();
  void Complain(const std::string& of);
  void Wait(int timeout_ms);
  void Flush();
  void Receive();
  std::optional<Frame> FirstFrame();
  bool DeliverOne();
  void PutWord(uint32_t value);
  void PutText(const std::string& text);

  const std::string url_;
  sockaddr_in address_{};
  std::mutex mutex_;  // fd_, state_, unsent_
  int fd_ = -1;
  State state_ = State::kAway;
  int64_t tried_us_ = 0;
  std::vector<uint8_t> unsent_;
  std::vector<uint8_t> received_;
  size_t taken_ = 0;  // of received_
  bool greeted_ = false;
  int64_t waits_since_us_ = 0;  // for a greeting
  std::string last_error_ = "no answer";
  bool complained_ = false;
  Subscriptions subscriptions_;
};

}  // namespace pangea
