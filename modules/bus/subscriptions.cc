#include "bus/subscriptions.h"

#include <utility>

namespace pangea {

void Subscriptions::Add(const std::string& channel_regex, Bus::Handler handler) {
  subscriptions_.push_back({channel_regex, std::regex(channel_regex), std::move(handler)});
  matching_.clear();
}

const std::vector<size_t>& Subscriptions::Matching(const std::string& channel) {
  if (const auto known = matching_.find(channel); known != matching_.end()) {
    return known->second;
  }
  if (matching_.size() >= kMaxRemembered) {
    matching_.clear();
  }
  std::vector<size_t>& matching = matching_[channel];
  for (size_t i = 0; i < subscriptions_.size(); ++i) {
    if (std::regex_match(channel, subscriptions_[i].regex)) {
      matching.push_back(i);
    }
  }
  return matching;
}

}  // namespace pangea
