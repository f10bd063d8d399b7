#include "bus/transport/udpm_receiver.h"

#include <linux/sock_diag.h>
#include <poll.h>
#include <pthread.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <stdexcept>
#include <utility>

namespace pangea {
namespace {

constexpr size_t kMaxDatagram = 1 << 16;
// After this many datagrams the thread checks whether to stop, even if more are waiting.
constexpr int kAtOnce = 64;
// Approximate memory of a message, beside its data.
constexpr size_t kMessageOverhead = 200;

int EventFd() {
  const int fd = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
  if (fd < 0) {
    throw std::runtime_error("cannot open a bus: too many open files (ulimit -n)");
  }
  return fd;
}

}  // namespace

UdpmReceiver::UdpmReceiver(const UdpmAddress& address, LcmBus::Fragments fragments)
    : address_(address), fragments_(fragments), waits_fd_(EventFd()), stop_fd_(EventFd()) {}

UdpmReceiver::~UdpmReceiver() {
  if (reader_.joinable()) {
    eventfd_write(stop_fd_, 1);
    reader_.join();
    close(socket_);
  }
  close(stop_fd_);
  close(waits_fd_);
}

// The reader thread blocks all signals, so that they interrupt the thread that handles messages.
void UdpmReceiver::Start() {
  socket_ = OpenUdpmSocket(address_, fragments_);
  sigset_t all, before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  reader_ = std::thread([this] { Run(); });
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

void UdpmReceiver::Subscribe(const std::string& channel_regex, Bus::Handler handler) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    subscriptions_.Add(channel_regex, std::move(handler));
    waiting_.push_back(0);
  }
  if (!reader_.joinable()) {
    Start();
  }
}

void UdpmReceiver::Run() {
  std::vector<uint8_t> buffer(kMaxDatagram);
  std::array<pollfd, 2> fds{{{socket_, POLLIN, 0}, {stop_fd_, POLLIN, 0}}};
  while (fds[1].revents == 0) {
    poll(fds.data(), fds.size(), -1);
    ReadSome(&buffer);
  }
}

void UdpmReceiver::ReadSome(std::vector<uint8_t>* buffer) {
  for (int i = 0; i < kAtOnce; ++i) {
    sockaddr_in from{};
    socklen_t from_size = sizeof(from);
    const ssize_t size = recvfrom(socket_, buffer->data(), buffer->size(), 0,
                                  reinterpret_cast<sockaddr*>(&from), &from_size);
    if (size < 0) {  // no datagram is left, or one had an error, which recvfrom has cleared
      return;
    }
    const uint64_t sender = uint64_t{from.sin_addr.s_addr} << 16 | from.sin_port;
    Take(Bytes(*buffer).first(static_cast<size_t>(size)), sender);
  }
}

void UdpmReceiver::Take(Bytes datagram, uint64_t sender) {
  std::unique_lock<std::mutex> lock(mutex_);
  const std::optional<UdpmAssembler::Message> message = assembler_.Take(datagram, sender);
  const bool was_empty = queue_.empty();
  if (!message || !Enqueue(*message)) {
    return;
  }
  lock.unlock();  // first, or the thread that is woken would wait for the mutex
  if (was_empty) {
    eventfd_write(waits_fd_, 1);
  }
}

std::vector<size_t> UdpmReceiver::WithRoom(const std::vector<size_t>& subscriptions) {
  std::vector<size_t> with_room;
  for (const size_t subscription : subscriptions) {
    if (waiting_[subscription] < kMaxWaiting) {
      with_room.push_back(subscription);
    }
  }
  return with_room;
}

bool UdpmReceiver::Enqueue(const UdpmAssembler::Message& message) {
  const std::vector<size_t>& wanted = subscriptions_.Matching(message.channel);
  if (wanted.empty()) {
    return false;
  }
  std::vector<size_t> to = WithRoom(wanted);
  const size_t bytes = message.data.size() + kMessageOverhead;
  const bool fits = queue_bytes_ + bytes <= kMaxWaitingBytes;
  if (!fits || to.size() < wanted.size()) {
    ++no_room_;  // at least one subscription misses it
  }
  if (!fits || to.empty()) {
    return false;
  }
  for (const size_t subscription : to) {
    ++waiting_[subscription];
  }
  queue_bytes_ += bytes;
  queue_.push_back({message.channel, {message.data.begin(), message.data.end()}, std::move(to)});
  return true;
}

void UdpmReceiver::ClearFd() const {
  eventfd_t ignored = 0;
  eventfd_read(waits_fd_, &ignored);
}

// The reader thread wrote it after the message was delivered.
void UdpmReceiver::ClearStaleFd() {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (queue_.empty()) {
    ClearFd();
  }
}

bool UdpmReceiver::DeliverOne() {
  std::unique_lock<std::mutex> lock(mutex_);
  if (queue_.empty()) {
    return false;
  }
  const Message message = std::move(queue_.front());
  queue_.pop_front();
  queue_bytes_ -= message.data.size() + kMessageOverhead;
  for (const size_t subscription : message.to) {
    --waiting_[subscription];
  }
  if (queue_.empty()) {
    ClearFd();
  }
  lock.unlock();
  // Without the mutex: only this thread adds subscriptions, and they are never moved in memory.
  for (const size_t subscription : message.to) {
    subscriptions_.handler(subscription)(message.channel, message.data);
  }
  return true;
}

bool UdpmReceiver::Handle(int timeout_ms) {
  if (DeliverOne()) {
    return true;
  }
  pollfd waits{waits_fd_, POLLIN, 0};
  while (poll(&waits, 1, timeout_ms) > 0) {
    if (DeliverOne()) {
      return true;
    }
    ClearStaleFd();
  }
  return false;
}

bool UdpmReceiver::MoreWaits() {
  const std::lock_guard<std::mutex> lock(mutex_);
  return !queue_.empty();
}

int64_t UdpmReceiver::DroppedByKernel() const {
  std::array<uint32_t, SK_MEMINFO_VARS> info{};
  socklen_t size = sizeof(info);
  return getsockopt(socket_, SOL_SOCKET, SO_MEMINFO, info.data(), &size) == 0
             ? info[SK_MEMINFO_DROPS]
             : 0;
}

Bus::Undelivered UdpmReceiver::undelivered() {
  const int64_t by_kernel = DroppedByKernel();
  const std::lock_guard<std::mutex> lock(mutex_);
  return {assembler_.refused(), no_room_, by_kernel};
}

}  // namespace pangea
