#pragma once

// Receives the messages of an LCM multicast bus (udpm://). Its own thread takes the datagrams from
// the socket at once, because the kernel buffers little (212 kB unless the administrator allows
// more) and a process may compute for seconds. Messages with a subscription wait in a queue. Handle
// delivers them on the thread that calls it.
//
// Bounds: at most kMaxWaiting messages wait per subscription, and kMaxWaitingBytes in all. Beyond
// that, new messages are dropped and counted. Datagrams are checked (udpm_assembler.h).
//
// Threads: one mutex guards all that both threads use: subscriptions, assembler, queue and counts.
// It is not held while a handler runs or a thread waits. Subscribe and Handle must be called by one
// thread.

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
  // Keyframes are the largest messages (28 kB), so kMaxWaiting of them take 56 MB. Messages dropped
  // beyond that are asked for again.
  static constexpr size_t kMaxWaiting = 2000;
  static constexpr size_t kMaxWaitingBytes = 64 << 20;

  // Opens no socket; the first Subscribe does. A process that only publishes needs none.
  UdpmReceiver(const UdpmAddress& address, LcmBus::Fragments fragments);
  ~UdpmReceiver();
  UdpmReceiver(const UdpmReceiver&) = delete;
  UdpmReceiver& operator=(const UdpmReceiver&) = delete;

  // Throws std::system_error if the socket cannot be opened.
  void Subscribe(const std::string& channel_regex, Bus::Handler handler);
  // Delivers one message, for which it waits at most `timeout_ms`; a signal ends the wait. Returns
  // whether a message was delivered.
  bool Handle(int timeout_ms);
  bool MoreWaits();
  // A file descriptor that is readable while messages wait.
  int fd() const { return waits_fd_; }
  Bus::Undelivered undelivered();

 private:
  struct Message {
    std::string channel;
    std::vector<uint8_t> data;
    std::vector<size_t> to;  // numbers of the subscriptions
  };

  void Start();
  void Run();
  void ReadSome(std::vector<uint8_t>* buffer);
  void Take(Bytes datagram, uint64_t sender);
  std::vector<size_t> WithRoom(const std::vector<size_t>& subscriptions);
  bool Enqueue(const UdpmAssembler::Message& message);
  void ClearFd() const;
  void ClearStaleFd();
  bool DeliverOne();
  int64_t DroppedByKernel() const;

  const UdpmAddress address_;
  const LcmBus::Fragments fragments_;
  const int waits_fd_;
  const int stop_fd_;
  int socket_ = -1;  // set before the thread starts
  std::thread reader_;

  std::mutex mutex_;  // guards all members below
  Subscriptions subscriptions_;
  std::vector<size_t> waiting_;  // number of waiting messages of each subscription
  std::deque<Message> queue_;
  size_t queue_bytes_ = 0;
  int64_t no_room_ = 0;
  UdpmAssembler assembler_;
};

}  // namespace pangea
