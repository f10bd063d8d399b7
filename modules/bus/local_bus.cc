#include <deque>

#include "bus/bus.h"
#include "bus/subscriptions.h"

namespace pangea {

struct LocalBus::Impl {
  struct Event {
    std::string channel;
    std::vector<uint8_t> data;
  };
  Subscriptions subscriptions;
  std::deque<Event> events;
};

LocalBus::LocalBus() : impl_(std::make_unique<Impl>()) {}
LocalBus::~LocalBus() = default;

void LocalBus::Publish(const std::string& channel, Bytes data) {
  impl_->events.push_back({channel, {data.begin(), data.end()}});
}

void LocalBus::Subscribe(const std::string& channel_regex, Handler handler) {
  impl_->subscriptions.Add(channel_regex, std::move(handler));
}

void LocalBus::Drain() {
  while (!impl_->events.empty()) {
    const Impl::Event event = std::move(impl_->events.front());
    impl_->events.pop_front();
    // A copy: handlers may subscribe while one of them runs.
    const std::vector<size_t> wanting = impl_->subscriptions.Matching(event.channel);
    for (const size_t subscription : wanting) {
      impl_->subscriptions.handler(subscription)(event.channel, event.data);
    }
  }
}

}  // namespace pangea
