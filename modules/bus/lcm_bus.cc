#include <fmt/format.h>
#include <poll.h>

#include <cstdlib>
#include <deque>
#include <exception>
#include <lcm/lcm-cpp.hpp>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "bus/bus.h"
#include "bus/transport/tcpq_connection.h"
#include "bus/transport/udpm_receiver.h"

namespace pangea {
namespace {

[[noreturn]] void ThrowNotOpened(const std::string& url, const std::string& why) {
  throw std::runtime_error(fmt::format(
      "cannot open the bus '{}'{}: check the URL, and that the machine has a multicast route "
      "(ip route add 224.0.0.0/4 dev lo)",
      url, why));
}

// The URL that LCM itself would use.
std::string GivenOrDefault(const std::string& url) {
  const char* const environment = std::getenv("LCM_DEFAULT_URL");
  if (!url.empty() || environment == nullptr || *environment == 0) {
    return url.empty() ? "udpm://" : url;
  }
  return environment;
}

}  // namespace

// Three kinds of bus. Library: LCM does all (memq:// and file://). Multicast: LCM sends, and we
// receive (udpm_receiver.h). Relayed: we have our own client of the relay (tcpq_connection.h).
struct LcmBus::Impl {
  virtual ~Impl() = default;
  virtual void Publish(const std::string& channel, Bytes data) = 0;
  virtual void Subscribe(const std::string& channel_regex, Handler handler) = 0;
  virtual bool Handle(int timeout_ms) = 0;
  virtual bool MoreWaits() = 0;
  virtual Undelivered undelivered() { return {}; }
  virtual int fd() = 0;
};

struct LcmBus::Library : LcmBus::Impl {
  explicit Library(const std::string& url) : lcm(url) {
    if (!lcm.good()) {
      ThrowNotOpened(url, "");
    }
  }

  struct Subscription {
    Library* owner;
    Handler handler;
    // We use LCM's C interface, because the C++ wrapper, built by GCC 12 with
    // -fsanitize=address,undefined, called its member function on the wrong object.
    static void OnMessage(const lcm_recv_buf_t* buffer, const char* channel, void* subscription) {
      auto* self = static_cast<Subscription*>(subscription);
      try {
        self->handler(channel, {static_cast<const uint8_t*>(buffer->data), buffer->data_size});
      } catch (...) {  // must not cross LCM's C frames; Handle() rethrows it
        self->owner->failure = std::current_exception();
      }
    }
  };

  void Publish(const std::string& channel, Bytes data) override {
    lcm.publish(channel, data.data(), static_cast<unsigned int>(data.size()));
  }
  void Subscribe(const std::string& channel_regex, Handler handler) override {
    subscriptions.push_back({this, std::move(handler)});
    lcm_subscription_t* subscription =
        lcm_subscribe(lcm.getUnderlyingLCM(), channel_regex.c_str(), &Subscription::OnMessage,
                      &subscriptions.back());
    lcm_subscription_set_queue_capacity(subscription, UdpmReceiver::kMaxWaiting);
  }
  bool Handle(int timeout_ms) override {
    const bool handled = lcm.handleTimeout(timeout_ms) > 0;
    if (failure) {
      std::rethrow_exception(std::exchange(failure, nullptr));
    }
    return handled;
  }
  bool MoreWaits() override {
    pollfd poll_fd{fd(), POLLIN, 0};
    return poll(&poll_fd, 1, 0) > 0 && (poll_fd.revents & POLLIN) != 0;
  }
  int fd() override { return lcm.getFileno(); }

  lcm::LCM lcm;
  std::deque<Subscription> subscriptions;
  std::exception_ptr failure;
};

struct LcmBus::Multicast : LcmBus::Impl {
  Multicast(const std::string& url, Fragments fragments)
      : bus_url(url), receiver(WithRoute(url), fragments), lcm(url) {
    if (!lcm.good()) {
      ThrowNotOpened(url, "");
    }
  }
  // We check the route before LCM does, because LCM's advice no longer helps.
  static UdpmAddress WithRoute(const std::string& url) {
    const UdpmAddress address = ParseUdpmUrl(url);
    try {
      CheckRoute(address);
    } catch (const std::system_error& error) {
      ThrowNotOpened(url, fmt::format(" ({})", error.what()));
    }
    return address;
  }
  void Publish(const std::string& channel, Bytes data) override {
    lcm.publish(channel, data.data(), static_cast<unsigned int>(data.size()));
  }
  void Subscribe(const std::string& channel_regex, Handler handler) override {
    try {
      receiver.Subscribe(channel_regex, std::move(handler));
    } catch (const std::system_error& error) {
      ThrowNotOpened(bus_url, fmt::format(" ({})", error.what()));
    }
  }
  bool Handle(int timeout_ms) override { return receiver.Handle(timeout_ms); }
  bool MoreWaits() override { return receiver.MoreWaits(); }
  Undelivered undelivered() override { return receiver.undelivered(); }
  int fd() override { return receiver.fd(); }

  const std::string bus_url;
  UdpmReceiver receiver;
  lcm::LCM lcm;  // sends; it opens no receiving socket unless it is asked for messages
};

struct LcmBus::Relayed : LcmBus::Impl {
  explicit Relayed(const std::string& url) : connection(url) {}
  void Publish(const std::string& channel, Bytes data) override {
    connection.Publish(channel, data);
  }
  void Subscribe(const std::string& channel_regex, Handler handler) override {
    connection.Subscribe(channel_regex, std::move(handler));
  }
  bool Handle(int timeout_ms) override { return connection.Handle(timeout_ms); }
  bool MoreWaits() override { return connection.MoreWaits(); }
  int fd() override { return connection.fd(); }

  TcpqConnection connection;
};

std::unique_ptr<LcmBus::Impl> LcmBus::Open(const std::string& url, Fragments fragments) {
  if (url.starts_with("tcpq://")) {
    return std::make_unique<Relayed>(url);
  }
  if (url.starts_with("udpm://")) {
    return std::make_unique<Multicast>(url, fragments);
  }
  if (url.starts_with("memq://") || url.starts_with("file://")) {
    return std::make_unique<Library>(url);
  }
  throw std::runtime_error(
      fmt::format("cannot open the bus '{}': give udpm://, tcpq://, memq:// or file://", url));
}

LcmBus::LcmBus(const std::string& url, Fragments fragments)
    : impl_(Open(GivenOrDefault(url), fragments)) {}
LcmBus::~LcmBus() = default;

void LcmBus::Publish(const std::string& channel, Bytes data) { impl_->Publish(channel, data); }

void LcmBus::Subscribe(const std::string& channel_regex, Handler handler) {
  impl_->Subscribe(channel_regex, std::move(handler));
}

int LcmBus::fd() { return impl_->fd(); }

bool LcmBus::MoreWaits() { return impl_->MoreWaits(); }

Bus::Undelivered LcmBus::undelivered() { return impl_->undelivered(); }

void LcmBus::WorkWhenIdle(const std::function<bool()>& piece) { work_ = piece; }

bool LcmBus::Handle(int timeout_ms) {
  const bool handled = impl_->Handle(work_ ? 0 : timeout_ms);
  if (!work_ || (handled && ++handled_since_work_ < kMaxBeforeWork)) {
    return handled;
  }
  handled_since_work_ = 0;
  std::function<bool()> piece = std::exchange(work_, nullptr);
  if (piece() && !work_) {  // it may have given other work
    work_ = std::move(piece);
  }
  return true;
}

}  // namespace pangea
