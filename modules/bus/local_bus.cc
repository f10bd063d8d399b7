#include <deque>
#include <regex>

#include "bus/bus.h"

namespace pangea {

struct LocalBus::Impl {
  struct Subscription {
    std::regex channel;
    Handler handler;
  };
  struct Event {
    std::string channel;
    std::vector<uint8_t> data;
  };
  // A deque: handlers may subscribe while one of them runs.
  std::deque<Subscription> subscriptions;
  std::deque<Event> events;
};

LocalBus::LocalBus() : impl_(std::make_unique<Impl>()) {}
LocalBus::~LocalBus() = default;

void LocalBus::Publish(const std::string& channel, Bytes data) {
  impl_->events.push_back({channel, {data.begin(), data.end()}});
}

void LocalBus::Subscribe(const std::string& channel_regex, Handler handler) {
  impl_->subscriptions.push_back({std::regex(channel_regex), std::move(handler)});
}

void LocalBus::Drain() {
  while (!impl_->events.empty()) {
    const Impl::Event event = std::move(impl_->events.front());
    impl_->events.pop_front();
    for (size_t i = 0; i < impl_->subscriptions.size(); ++i) {
      if (std::regex_match(event.channel, impl_->subscriptions[i].channel)) {
        impl_->subscriptions[i].handler(event.channel, event.data);
      }
    }
  }
}

}  // namespace pangea
