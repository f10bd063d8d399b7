#include "uplink/agent_anchors.h"

#include <algorithm>
#include <utility>

namespace pangea {
namespace {

constexpr int64_t kAgain_us = 10'000'000;

}  // namespace

std::optional<AnchorState> AgentAnchors::MakeRoomFor(const AnchorState& state) {
  if (anchors_.contains(state.anchor) || anchors_.size() < kMaxAnchors) {
    return std::nullopt;
  }
  constexpr int kInUse = 3;
  const auto usefulness = [&](const auto& item) {
    const Entry& entry = item.second;
    if (entry.state.gone) {
      return 0;
    }
    if (entry.state.map != state.map) {
      return 1;
    }
    return entry.number == 0 ? 2 : kInUse;
  };
  const auto least =
      std::min_element(anchors_.begin(), anchors_.end(),
                       [&](const auto& a, const auto& b) { return usefulness(a) < usefulness(b); });
  if (usefulness(*least) == kInUse) {
    return std::nullopt;
  }
  AnchorState left_out = std::move(least->second.state);
  anchors_.erase(least);
  return left_out;
}

AgentAnchors::Taken AgentAnchors::Take(const LinkAnchor& anchor, int64_t now_us) {
  const AnchorId& id = anchor.state.anchor;
  if (!anchors_.contains(id) && anchors_.size() >= kMaxAnchors) {
    return Taken::kFull;  // not confirmed, so the server sends it again
  }
  if (received_.size() < kMaxAnchorsReceived) {
    received_.push_back(anchor.number);
  }
  Entry& entry = anchors_[id];
  if (anchor.number <= entry.number) {
    return Taken::kKnown;
  }
  entry = {anchor.state, anchor.number, now_us};
  return Taken::kNew;
}

void AgentAnchors::OnNewSession() {
  received_.clear();
  for (auto& [id, entry] : anchors_) {
    entry.number = 0;
  }
}

std::vector<AnchorState> AgentAnchors::DueAgain(int64_t now_us) {
  std::vector<AnchorState> due;
  for (auto& [id, entry] : anchors_) {
    if (now_us - entry.told_us >= kAgain_us) {
      entry.told_us = now_us;
      due.push_back(entry.state);
    }
  }
  return due;
}

}  // namespace pangea
