#include <fmt/format.h>
#include <poll.h>

#include <deque>
#include <exception>
#include <lcm/lcm-cpp.hpp>
#include <stdexcept>
#include <utility>

#include "common/bus/bus.h"

namespace pangea {
namespace {

// LCM drops the newest messages of a subscription beyond this many unhandled ones. Keyframes are
// the largest (28 kB), so at most 56 MB wait per subscription; what is lost beyond that is asked
// for again.
constexpr int kQueueCapacity = 2000;

}  // namespace

struct LcmBus::Impl {
  explicit Impl(const std::string& url) : lcm(url) {}

  struct Subscription {
    Impl* owner;
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

  lcm::LCM lcm;
  std::deque<Subscription> subscriptions;
  std::exception_ptr failure;
};

LcmBus::LcmBus(const std::string& url) : impl_(std::make_unique<Impl>(url)) {
  if (!impl_->lcm.good()) {
    throw std::runtime_error(fmt::format(
        "cannot open the bus '{}': check the URL, and that the machine has a multicast route "
        "(ip route add 224.0.0.0/4 dev lo)",
        url));
  }
}
LcmBus::~LcmBus() = default;

void LcmBus::Publish(const std::string& channel, Bytes data) {
  impl_->lcm.publish(channel, data.data(), static_cast<unsigned int>(data.size()));
}

void LcmBus::Subscribe(const std::string& channel_regex, Handler handler) {
  impl_->subscriptions.push_back({impl_.get(), std::move(handler)});
  lcm_subscription_t* subscription =
      lcm_subscribe(impl_->lcm.getUnderlyingLCM(), channel_regex.c_str(),
                    &Impl::Subscription::OnMessage, &impl_->subscriptions.back());
  lcm_subscription_set_queue_capacity(subscription, kQueueCapacity);
}

int LcmBus::fd() { return impl_->lcm.getFileno(); }

bool LcmBus::MoreWaits() {
  pollfd poll_fd{fd(), POLLIN, 0};
  return poll(&poll_fd, 1, 0) > 0 && (poll_fd.revents & POLLIN) != 0;
}

bool LcmBus::Handle(int timeout_ms) {
  // A tcpq connection that broke has fd -1, and handling it would abort.
  if (fd() < 0) {
    throw std::runtime_error("the bus connection is gone");
  }
  const bool handled = impl_->lcm.handleTimeout(timeout_ms) > 0;
  if (impl_->failure) {
    std::rethrow_exception(std::exchange(impl_->failure, nullptr));
  }
  return handled;
}

}  // namespace pangea
