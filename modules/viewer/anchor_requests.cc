#include "viewer/anchor_requests.h"

#include <algorithm>
#include <utility>

namespace pangea::viewer {

bool AnchorRequests::Add(AnchorEdit edit, int64_t now_utime) {
  const auto known = pending_.find(edit.anchor);
  if (known != pending_.end()) {
    edit.revision = std::max(edit.revision, known->second.edit.revision + 1);
  } else if (pending_.size() >= kMaxPending) {
    return false;
  }
  const AnchorId anchor = edit.anchor;
  pending_.insert_or_assign(anchor, Pending{std::move(edit), now_utime, now_utime});
  return true;
}

void AnchorRequests::Heard(const AnchorId& anchor, int64_t revision) {
  const auto known = pending_.find(anchor);
  if (known != pending_.end() && revision >= known->second.edit.revision) {
    pending_.erase(known);
  }
}

std::vector<AnchorEdit> AnchorRequests::Due(int64_t now_utime) {
  std::vector<AnchorEdit> due;
  for (auto& [anchor, pending] : pending_) {
    if (now_utime >= pending.next_utime) {
      pending.next_utime = now_utime + kInterval_us;
      due.push_back(pending.edit);
    }
  }
  return due;
}

std::vector<AnchorEdit> AnchorRequests::TakeGivenUp(int64_t now_utime) {
  std::vector<AnchorEdit> given_up;
  std::erase_if(pending_, [&](const auto& item) {
    const bool late = now_utime - item.second.since_utime >= kPatience_us;
    if (late) {
      given_up.push_back(item.second.edit);
    }
    return late;
  });
  return given_up;
}

}  // namespace pangea::viewer
