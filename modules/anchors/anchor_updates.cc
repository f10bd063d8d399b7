#include "anchors/anchor_updates.h"

#include <utility>

namespace pangea {

bool AnchorUpdates::IsDue(const AnchorState& state, const Sent& sent, int64_t now_utime) {
  const int64_t since_us = now_utime - sent.utime;
  if (state.gone && sent.state.gone) {
    return since_us >= (sent.times_gone < kTimesGone ? kInterval_us : kRepeat_us);
  }
  const bool is_other = state.gone != sent.state.gone || state.revision != sent.state.revision ||
                        state.edited_by != sent.state.edited_by || state.map != sent.state.map ||
                        state.group != sent.state.group;
  const Vector6d moved = state.T_odom_anchor.Minus(sent.state.T_odom_anchor);
  const bool has_moved =
      moved.head<3>().norm() > kAnchorMoved_m || moved.tail<3>().norm() > kAnchorMoved_rad;
  return ((is_other || has_moved) && since_us >= kInterval_us) || since_us >= kRepeat_us;
}

std::vector<AnchorState> AnchorUpdates::Due(const std::vector<AnchorState>& states,
                                            int64_t now_utime) {
  std::vector<AnchorState> due;
  std::map<AnchorId, Sent> sent;
  for (const AnchorState& state : states) {
    auto known = sent_.extract(state.anchor);
    Sent& entry = sent[state.anchor];
    if (known && !IsDue(state, known.mapped(), now_utime)) {
      entry = std::move(known.mapped());
      continue;
    }
    entry = {state, now_utime, state.gone ? 1 + (known ? known.mapped().times_gone : 0) : 0};
    due.push_back(state);
  }
  sent_ = std::move(sent);
  return due;
}

std::set<AnchorId> AnchorUpdates::Told() const {
  std::set<AnchorId> told;
  for (const auto& [id, sent] : sent_) {
    if (!sent.state.gone || sent.times_gone < kTimesGone) {
      told.insert(id);
    }
  }
  return told;
}

}  // namespace pangea
