#include "bus/transport/tcpq_connection.h"

#include <fmt/format.h>
#include <netdb.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <iostream>
#include <stdexcept>
#include <thread>
#include <utility>

#include "bus/process.h"
#include "core/big_endian.h"

namespace pangea {
namespace {

constexpr uint32_t kServerMagic = 0x287617fa;
constexpr uint32_t kClientMagic = 0x287617fb;
constexpr uint32_t kProtocolVersion = 0x0100;
constexpr uint32_t kPublish = 1;
constexpr uint32_t kSubscribe = 2;
constexpr size_t kMaxChannel = 255;
constexpr size_t kReadBytes = 1 << 16;
// The connection is closed when the relay has not acknowledged sent bytes for this time.
constexpr unsigned kUnansweredTimeout_ms = 10'000;

sockaddr_in Resolve(const std::string& url) {
  const std::string rest = url.substr(std::strlen("tcpq://"));
  const size_t colon = rest.find(':');
  const std::string host = rest.substr(0, colon);
  const std::string port = colon == std::string::npos ? "7700" : rest.substr(colon + 1);
  addrinfo hints{};
  hints.ai_family = AF_INET;
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  const int error =
      getaddrinfo(host.empty() ? "127.0.0.1" : host.c_str(), port.c_str(), &hints, &found);
  if (error != 0) {
    throw std::runtime_error(fmt::format("cannot use the bus '{}': {}; give tcpq://HOST:PORT", url,
                                         gai_strerror(error)));
  }
  sockaddr_in address{};
  std::memcpy(&address, found->ai_addr, sizeof(address));
  freeaddrinfo(found);
  return address;
}

}  // namespace

TcpqConnection::TcpqConnection(const std::string& url)
    : url_(url),
      address_(Resolve(url)),
      tried_us_(SteadyMicros() - kRetry_us),
      waits_since_us_(SteadyMicros()) {
  Handle(0);
}

TcpqConnection::~TcpqConnection() {
  if (fd_ >= 0) {
    close(fd_);
  }
}

void TcpqConnection::Connect() {
  if (SteadyMicros() < tried_us_ + kRetry_us) {
    return;
  }
  tried_us_ = SteadyMicros();
  fd_ = socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (fd_ < 0) {
    return;
  }
  const int on = 1;
  setsockopt(fd_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof(on));
  setsockopt(fd_, SOL_SOCKET, SO_KEEPALIVE, &on, sizeof(on));
  setsockopt(fd_, IPPROTO_TCP, TCP_USER_TIMEOUT, &kUnansweredTimeout_ms,
             sizeof(kUnansweredTimeout_ms));
  state_ = State::kConnecting;
  const int result = connect(fd_, reinterpret_cast<sockaddr*>(&address_), sizeof(address_));
  if (result == 0) {
    OnConnected();
  } else if (errno != EINPROGRESS) {
    Disconnect(std::strerror(errno));
  }
}

void TcpqConnection::OnConnected() {
  state_ = State::kConnected;
  received_.clear();
  taken_ = 0;
  unsent_.clear();
  PutWord(kClientMagic);
  PutWord(kProtocolVersion);
  for (size_t i = 0; i < subscriptions_.size(); ++i) {
    PutWord(kSubscribe);
    PutText(subscriptions_.text(i));
  }
}

void TcpqConnection::OnGreeted() {
  greeted_ = true;
  last_error_ = "no answer";
  if (std::exchange(complained_, false)) {
    std::cerr << fmt::format("{}: the relay is there\n", url_);
  }
}

void TcpqConnection::Complain(const std::string& of) {
  if (!std::exchange(complained_, true)) {
    std::cerr << fmt::format("{}: {}; trying again\n", url_, of);
  }
}

void TcpqConnection::CheckPatience() {
  const int64_t now_us = SteadyMicros();
  if (state_ == State::kConnecting && now_us > tried_us_ + kConnecting_us) {
    Disconnect("no answer");
  }
  if (!greeted_ && now_us > waits_since_us_ + kPatience_us) {
    Complain(
        fmt::format("no relay there ({}): is the address right, and does it run (java -cp "
                    "/usr/share/java/lcm.jar lcm.lcm.TCPService {})?",
                    last_error_, ntohs(address_.sin_port)));
  }
}

void TcpqConnection::Disconnect(const char* why) {
  last_error_ = why;
  if (std::exchange(greeted_, false)) {
    waits_since_us_ = SteadyMicros();
    Complain(fmt::format("the relay is gone ({})", why));
  }
  close(fd_);
  fd_ = -1;
  state_ = State::kAway;
  unsent_.clear();
  taken_ = received_.size();  // the bytes are kept, because a handler may be reading them
}

int TcpqConnection::fd() {
  const std::lock_guard<std::mutex> lock(mutex_);
  return fd_;
}

void TcpqConnection::PutWord(uint32_t value) { PutBigEndian(value, sizeof(value), &unsent_); }

void TcpqConnection::PutText(const std::string& text) {
  PutWord(static_cast<uint32_t>(text.size()));
  unsent_.insert(unsent_.end(), text.begin(), text.end());
}

void TcpqConnection::Publish(const std::string& channel, Bytes data) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (state_ != State::kConnected || unsent_.size() + data.size() > kMaxUnsent) {
    return;
  }
  PutWord(kPublish);
  PutText(channel);
  PutWord(static_cast<uint32_t>(data.size()));
  unsent_.insert(unsent_.end(), data.begin(), data.end());
  Flush();
}

void TcpqConnection::Subscribe(const std::string& channel_regex, Bus::Handler handler) {
  const std::lock_guard<std::mutex> lock(mutex_);
  subscriptions_.Add(channel_regex, std::move(handler));
  if (state_ == State::kConnected) {
    PutWord(kSubscribe);
    PutText(channel_regex);
    Flush();
  }
}

void TcpqConnection::Flush() {
  size_t sent = 0;
  while (sent < unsent_.size()) {
    const ssize_t n = send(fd_, unsent_.data() + sent, unsent_.size() - sent, MSG_NOSIGNAL);
    if (n < 0 && errno != EAGAIN && errno != EINTR) {
      return Disconnect(std::strerror(errno));
    }
    if (n <= 0) {
      break;
    }
    sent += static_cast<size_t>(n);
  }
  unsent_.erase(unsent_.begin(), unsent_.begin() + static_cast<std::ptrdiff_t>(sent));
}

void TcpqConnection::Receive() {
  received_.erase(received_.begin(), received_.begin() + static_cast<std::ptrdiff_t>(taken_));
  taken_ = 0;
  const size_t before = received_.size();
  received_.resize(before + kReadBytes);
  const ssize_t n = recv(fd_, received_.data() + before, kReadBytes, 0);
  received_.resize(before + static_cast<size_t>(std::max<ssize_t>(n, 0)));
  if (n == 0 || (n < 0 && errno != EAGAIN && errno != EINTR)) {
    Disconnect(n == 0 ? "it closed the connection" : std::strerror(errno));
  }
}

std::optional<TcpqConnection::Frame> TcpqConnection::FirstFrame() {
  constexpr size_t kWord = 4;
  const Bytes rest = Bytes(received_).subspan(taken_);
  if (!greeted_) {
    if (rest.size() < 2 * kWord) {
      return std::nullopt;
    }
    if (WordAt(rest, 0) != kServerMagic) {
      Disconnect("what answers there is no LCM relay");
      return std::nullopt;
    }
    OnGreeted();
    taken_ += 2 * kWord;
    return FirstFrame();
  }
  if (rest.size() < 2 * kWord) {
    return std::nullopt;
  }
  const size_t channel_bytes = WordAt(rest, kWord);
  const size_t data_at = 3 * kWord + channel_bytes;
  if (channel_bytes <= kMaxChannel && rest.size() < data_at) {
    return std::nullopt;
  }
  const size_t data_bytes = channel_bytes <= kMaxChannel ? WordAt(rest, data_at - kWord) : 0;
  if (channel_bytes > kMaxChannel || data_bytes > kMaxMessage) {
    Disconnect("it sent no LCM message");
    return std::nullopt;
  }
  if (rest.size() < data_at + data_bytes) {
    return std::nullopt;
  }
  const Bytes name = rest.subspan(2 * kWord, channel_bytes);
  return Frame{
      {name.begin(), name.end()}, rest.subspan(data_at, data_bytes), taken_ + data_at + data_bytes};
}

// The mutex is not held while a handler runs, because a handler may publish.
bool TcpqConnection::DeliverOne() {
  std::unique_lock<std::mutex> lock(mutex_);
  const std::optional<Frame> frame = FirstFrame();
  if (!frame) {
    return false;
  }
  taken_ = frame->end;
  const std::vector<size_t> wanting = subscriptions_.Matching(frame->channel);
  lock.unlock();
  for (const size_t subscription : wanting) {
    subscriptions_.handler(subscription)(frame->channel, frame->data);
  }
  return true;
}

void TcpqConnection::Wait(int timeout_ms) {
  std::unique_lock<std::mutex> lock(mutex_);
  CheckPatience();
  if (state_ == State::kAway) {
    Connect();
  }
  if (fd_ < 0) {
    lock.unlock();
    std::this_thread::sleep_for(std::chrono::milliseconds(timeout_ms));
    return;
  }
  const bool writes = state_ == State::kConnecting || !unsent_.empty();
  pollfd poll_fd{fd_, static_cast<int16_t>(writes ? POLLIN | POLLOUT : POLLIN), 0};
  lock.unlock();
  poll(&poll_fd, 1, timeout_ms);
  lock.lock();
  if (fd_ < 0) {
    return;
  }
  if (state_ == State::kConnecting && (poll_fd.revents & (POLLOUT | POLLERR | POLLHUP)) != 0) {
    int error = 0;
    socklen_t size = sizeof(error);
    getsockopt(fd_, SOL_SOCKET, SO_ERROR, &error, &size);
    if (error != 0) {
      return Disconnect(std::strerror(error));
    }
    OnConnected();
  }
  if (state_ == State::kConnected) {
    Flush();
  }
  if (state_ == State::kConnected && (poll_fd.revents & (POLLIN | POLLERR | POLLHUP)) != 0) {
    Receive();
  }
}

bool TcpqConnection::Handle(int timeout_ms) {
  if (DeliverOne()) {
    return true;
  }
  Wait(timeout_ms);
  return DeliverOne();
}

bool TcpqConnection::MoreWaits() {
  const std::lock_guard<std::mutex> lock(mutex_);
  return FirstFrame().has_value();
}

}  // namespace pangea
