#pragma once

// A connection to LCM's TCP relay (tcpq://host:port; `java -cp lcm.jar lcm.lcm.TCPService PORT`),
// for networks without multicast. It never blocks, and reconnects for ever. LCM's own client hangs
// in a read or write when the relay is stopped, and aborts when it is gone. So this class
// implements the protocol, which has three kinds of message.
//
// A message is dropped if there is no relay, or if more than kMaxUnsent bytes are unsent. This is
// as on multicast: whoever needs the message asks for it again. Publish may be called by any
// thread, all else by one thread.

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
  static constexpr size_t kMaxMessage = 1 << 20;  // bytes; we have no larger messages
  static constexpr int64_t kRetry_us = 500'000;
  // When the relay has not answered for this time, one line on stderr says so, and another one when
  // it answers again.
  static constexpr int64_t kPatience_us = 2'000'000;
  // A connection attempt that takes longer is started anew; the kernel would wait ever longer.
  static constexpr int64_t kConnecting_us = 5'000'000;

  // Throws std::runtime_error if the URL's address cannot be resolved. The relay may start later.
  explicit TcpqConnection(const std::string& url);
  ~TcpqConnection();
  TcpqConnection(const TcpqConnection&) = delete;
  TcpqConnection& operator=(const TcpqConnection&) = delete;

  void Publish(const std::string& channel, Bytes data);
  void Subscribe(const std::string& channel_regex, Bus::Handler handler);
  // Delivers one message, for which it waits at most `timeout_ms`. While it waits, it connects if
  // needed and sends unsent bytes. Returns whether a message was delivered.
  bool Handle(int timeout_ms);
  // Whether Handle would deliver a message at once.
  bool MoreWaits();
  // -1 while there is no connection.
  int fd();

 private:
  enum class State : uint8_t { kAway, kConnecting, kConnected };
  // The first whole message in received_, and the index where it ends.
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
  std::mutex mutex_;  // guards fd_, state_, unsent_
  int fd_ = -1;
  State state_ = State::kAway;
  int64_t tried_us_ = 0;
  std::vector<uint8_t> unsent_;
  std::vector<uint8_t> received_;
  size_t taken_ = 0;  // bytes of received_ that are already delivered
  bool greeted_ = false;
  int64_t waits_since_us_ = 0;  // since when it waits for the relay's greeting
  std::string last_error_ = "no answer";
  bool complained_ = false;
  Subscriptions subscriptions_;
};

}  // namespace pangea
