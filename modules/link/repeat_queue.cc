#include "link/repeat_queue.h"

namespace pangea {
namespace {

constexpr int64_t kRepeat_us = 300'000;

}  // namespace

void RepeatQueue::Add(const AnchorId& id) {
  const auto [it, is_new] = turn_of_.try_emplace(id, last_turn_ + 1);
  last_turn_ += is_new ? 1 : 0;
  by_turn_[it->second] = {id, std::nullopt};
}

void RepeatQueue::Remove(const AnchorId& id) {
  if (const auto turn = turn_of_.extract(id)) {
    by_turn_.erase(turn.mapped());
  }
}

void RepeatQueue::SendAllAgain() {
  for (auto& [turn, waiting] : by_turn_) {
    waiting.sent_us.reset();
  }
}

std::optional<AnchorId> RepeatQueue::Next(int64_t now_us) {
  pacer_.Refill(now_us);
  if (!pacer_.Ready()) {
    return std::nullopt;
  }
  for (auto it = by_turn_.begin(); it != by_turn_.end(); ++it) {
    const Waiting& waiting = it->second;
    if (!waiting.sent_us || now_us - *waiting.sent_us >= kRepeat_us) {
      const AnchorId id = waiting.id;
      by_turn_.erase(it);
      by_turn_[++last_turn_] = {id, now_us};
      turn_of_[id] = last_turn_;
      return id;
    }
  }
  return std::nullopt;
}

}  // namespace pangea
