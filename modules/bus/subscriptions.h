#pragma once

// Who hears which channel, by LCM's rule: a regular expression that holds for the whole name. What
// the buses of our own have in common. Knows no threads: the owner locks.

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
  // Throws std::regex_error. What Matching returned is no longer valid; handlers are.
  void Add(const std::string& channel_regex, Bus::Handler handler);
  size_t size() const { return subscriptions_.size(); }
  // As it was given to Add.
  const std::string& text(size_t number) const { return subscriptions_[number].text; }
  const Bus::Handler& handler(size_t number) const { return subscriptions_[number].handler; }
  // The numbers of those that want the channel, in the order of Add. Remembered for the newest
  // channels: a regular expression costs microseconds.
  const std::vector<size_t>& Matching(const std::string& channel);

 private:
  static constexpr size_t kMaxRemembered = 1000;  // channels; strangers can make up any number

  struct Subscription {
    std::string text;
    std::regex regex;
    Bus::Handler handler;
  };
  std::deque<Subscription> subscriptions_;  // a deque: a handler that runs may add one
  std::unordered_map<std::string, std::vector<size_t>> matching_;
};

}  // namespace pangea
