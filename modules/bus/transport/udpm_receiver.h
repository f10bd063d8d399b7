#pragma once

// What comes over an LCM multicast bus (udpm://). A thread takes the datagrams from the socket as
// they come, for the kernel keeps few (212 kB unless its administrator allows more) and a process
// may solve for seconds; messages that somebody subscribed to wait here, and Handle delivers them
// on the thread that calls it.
//
// Bounds: a subscription has at most kMaxWaiting messages waiting, all together kMaxWaitingBytes;
// beyond that the newest are dropped, and counted. What arrives is checked (udpm_assembler.h).
//
// Threads: one mutex holds all that both threads touch: subscriptions, assembler, queue and counts.
// It is not held while a handler runs or anybody waits. Subscribe and Handle are for one thread.

#include <cstdint>
#include <deque>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "bus/subscriptions.h"
#include "bus/transport/udpm_assembler.h"
#include "bus/transport/udpm_socket.h"

namespace pangea {

class UdpmReceiver {
 public:
  // As LCM's subscriptions were given. Keyframes are the largest (28 kB): 56 MB of them. What is
  // lost beyond that is asked for again.
  static constexpr size_t kMaxWaiting = 2000;
  static constexpr size_t kMaxWaitingBytes = 64 << 20;

  // The socket is opened by the first Subscribe: who only publishes hears nothing.
  UdpmReceiver(const UdpmAddress& address, LcmBus::Fragments fragments);
  ~UdpmReceiver();
  UdpmReceiver(const UdpmReceiver&) = delete;
  UdpmReceiver& operator=(const UdpmReceiver&) = delete;

  // Throws std::system_error if the socket cannot be opened.
  void Subscribe(const std::string& channel_regex, Bus::Handler handler);
  // Delivers one message, waiting for it at most so long; less if a signal comes.
  bool Handle(int timeout_ms);
  bool MoreWaits();
  // Readable while a message waits; Handle makes it unreadable when none does.
  int fd() const { return waits_fd_; }
  Bus::Undelivered undelivered();

 private:
  struct Message {
    std::string channel;
    std::vector<uint8_t> data;
    std::vector<size_t> to;  // subscriptions
  };

  void Start();
  void Run();
  void ReadSome(std::vector<uint8_t>* buffer);
  void Take(Bytes datagram, uint64_t sender);
  std::vector<size_t> WithRoom(const std::vector<size_t>& subscriptions);
  bool Enqueue(const UdpmAssembler::Message& message);
  void ClearFd() const;
  bool DeliverOne();
  int64_t DroppedByKernel() const;

  const UdpmAddress address_;
  const LcmBus::Fragments fragments_;
  const int waits_fd_;
  const int stop_fd_;
  int socket_ = -1;  // set before the thread begins
  std::thread reader_;

  std::mutex mutex_;  // all below
  Subscriptions subscriptions_;
  std::vector<size_t> waiting_;  // messages, by subscription
  std::deque<Message> queue_;
  size_t queue_bytes_ = 0;
  int64_t no_room_ = 0;
  UdpmAssembler assembler_;
};

}  // namespace pangea
