#pragma once

// The subscriptions of a bus. By LCM's rule, a subscription's regular expression must match the
// whole channel name. All our own buses use this class. Not thread safe: the owner locks.

#include <cstddef>
#include <deque>
#include <regex>
#include <string>
#include <unordered_map>
#include <vector>

#include "bus/bus.h"

namespace pangea {

class Subscriptions {
 public:
  // Throws std::regex_error. Invalidates references that Matching returned, but no handler.
  void Add(const std::string& channel_regex, Bus::Handler handler);
  size_t size() const { return subscriptions_.size(); }
  // The channel_regex of a subscription.
  const std::string& text(size_t number) const { return subscriptions_[number].text; }
  const Bus::Handler& handler(size_t number) const { return subscriptions_[number].handler; }
  // Numbers of the subscriptions that match the channel, in the order of Add. Results are cached,
  // because matching a regular expression takes microseconds.
  const std::vector<size_t>& Matching(const std::string& channel);

 private:
  static constexpr size_t kMaxRemembered = 1000;  // channels; strangers can invent any number

  struct Subscription {
    std::string text;
    std::regex regex;
    Bus::Handler handler;
  };
  std::deque<Subscription> subscriptions_;  // a deque: a handler that runs may add one
  std::unordered_map<std::string, std::vector<size_t>> matching_;
};

}  // namespace pangea
