#include "agent_handler/journal/replication.h"

#include <algorithm>
#include <utility>

namespace pangea {

void Replication::OnReplicated(int64_t journal_bytes, int64_t now_us) {
  replicated_bytes_ = std::max(replicated_bytes_, journal_bytes);
  heard_us_ = now_us;
}

std::vector<Replication::Group> Replication::TakeKept() {
  std::vector<Group> kept;
  while (!groups_.empty() && (!wanted_ || groups_.front().journal_bytes <= replicated_bytes_)) {
    kept.push_back(std::move(groups_.front()));
    groups_.pop_front();
  }
  return kept;
}

bool Replication::Works(int64_t now_us) const {
  return !wanted_ ||
         (replicated_bytes_ >= bytes_at_start_ && now_us - heard_us_ < kLongestSilence_us);
}

bool Replication::Awaits(int32_t agent_id) const {
  return std::ranges::any_of(groups_, [&](const Group& group) {
    return std::ranges::any_of(group.keyframes,
                               [&](const KeyframeId& id) { return id.map.agent_id == agent_id; });
  });
}

}  // namespace pangea
