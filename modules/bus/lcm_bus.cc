#include <fmt/format.h>
#include <poll.h>

#include <deque>
#include <exception>
#include <lcm/lcm-cpp.hpp>
#include <optional>
#include <stdexcept>
#include <utility>

#include "bus/bus.h"
#include "bus/transport/host_only.h"
#include "bus/transport/tcpq_connection.h"

namespace pangea {
namespace {

// LCM drops the newest messages of a subscription beyond this many unhandled ones. Keyframes are
// the largest (28 kB), so at most 56 MB wait per subscription; what is lost beyond that is asked
// for again.
constexpr int kQueueCapacity = 2000;

}  // namespace

// Two kinds: LCM itself, and for tcpq:// our own, which cannot block (tcpq_connection.h).
struct LcmBus::Impl {
  virtual ~Impl() = default;
  virtual void Publish(const std::string& channel, Bytes data) = 0;
  virtual void Subscribe(const std::string& channel_regex, Handler handler) = 0;
  virtual bool Handle(int timeout_ms) = 0;
  virtual bool MoreWaits() = 0;
  virtual int fd() = 0;
};

struct LcmBus::Library : LcmBus::Impl {
  explicit Library(const std::string& url) : lcm(url), host_only_port(HostOnlyPort(url)) {
    if (!lcm.good()) {
      throw std::runtime_error(fmt::format(
          "cannot open the bus '{}': check the URL, and that the machine has a multicast route "
          "(ip route add 224.0.0.0/4 dev lo)",
          url));
    }
  }

  struct Subscription {
    Library* owner;
    Handler handler;
    // LCM's C interface: built by GCC 12 with -fsanitize=address,undefined, the C++ wrapper called
    // its member function on the wrong object.
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
  // LCM opens its socket with the first subscription. So the first one is to nothing, and others'
  // messages are kept out before anybody listens.
  void KeepOthersOut(uint16_t port) {
    lcm_t* const c_lcm = lcm.getUnderlyingLCM();
    lcm_unsubscribe(
        c_lcm, lcm_subscribe(
                   c_lcm, "nothing", [](const lcm_recv_buf_t*, const char*, void*) {}, nullptr));
    TakeOnlyFromThisHost(port);
  }
  void Subscribe(const std::string& channel_regex, Handler handler) override {
    if (host_only_port && subscriptions.empty()) {
      KeepOthersOut(*host_only_port);
    }
    subscriptions.push_back({this, std::move(handler)});
    lcm_subscription_t* subscription =
        lcm_subscribe(lcm.getUnderlyingLCM(), channel_regex.c_str(), &Subscription::OnMessage,
                      &subscriptions.back());
    lcm_subscription_set_queue_capacity(subscription, kQueueCapacity);
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
  const std::optional<uint16_t> host_only_port;
  std::deque<Subscription> subscriptions;
  std::exception_ptr failure;
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

LcmBus::LcmBus(const std::string& url) {
  if (url.starts_with("tcpq://")) {
    impl_ = std::make_unique<Relayed>(url);
  } else {
    impl_ = std::make_unique<Library>(url);
  }
}
LcmBus::~LcmBus() = default;

void LcmBus::Publish(const std::string& channel, Bytes data) { impl_->Publish(channel, data); }

void LcmBus::Subscribe(const std::string& channel_regex, Handler handler) {
  impl_->Subscribe(channel_regex, std::move(handler));
}

int LcmBus::fd() { return impl_->fd(); }

bool LcmBus::MoreWaits() { return impl_->MoreWaits(); }

void LcmBus::WorkWhenIdle(const std::function<bool()>& piece) { work_ = piece; }

bool LcmBus::Handle(int timeout_ms) {
  const bool handled = impl_->Handle(work_ ? 0 : timeout_ms);
  if (!work_ || (handled && ++handled_since_work_ < kMaxBeforeWork)) {
    return handled;
  }
  handled_since_work_ = 0;
  if (!work_()) {
    work_ = nullptr;
  }
  return true;
}

}  // namespace pangea
