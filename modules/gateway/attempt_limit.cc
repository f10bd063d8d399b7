#include "gateway/attempt_limit.h"

#include <algorithm>

namespace pangea {

bool AttemptLimit::MayTry(const std::string& address, int64_t now_us) {
  std::erase_if(forgotten_us_, [&](const auto& item) { return item.second <= now_us; });
  const auto found = forgotten_us_.find(address);
  return found == forgotten_us_.end() ? forgotten_us_.size() < kMaxAddresses
                                      : found->second - now_us <= (kBurst - 1) * kInterval_us;
}

void AttemptLimit::NoteWrong(const std::string& address, int64_t now_us) {
  int64_t& forgotten_us = forgotten_us_[address];
  forgotten_us = std::max(forgotten_us, now_us) + kInterval_us;
}

}  // namespace pangea
