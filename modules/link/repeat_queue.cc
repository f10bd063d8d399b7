#include "link/repeat_queue.h"

namespace pangea {
namespace {

constexpr int64_t kRepeat_us = 300'000;

}  // namespace

void RepeatQueue::Add(const AnchorId& id) {
  const auto [it, is_new] = order_of_.try_emplace(id, last_order_ + 1);
  last_order_ += is_new ? 1 : 0;
  by_order_[it->second] = {id, std::nullopt};
}

void RepeatQueue::Remove(const AnchorId& id) {
  if (const auto order = order_of_.extract(id)) {
    by_order_.erase(order.mapped());
  }
}

void RepeatQueue::SendAllAgain() {
  for (auto& [order, waiting] : by_order_) {
    waiting.sent_us.reset();
  }
}

std::optional<AnchorId> RepeatQueue::Next(int64_t now_us) {
  pacer_.Refill(now_us);
  if (!pacer_.Ready()) {
    return std::nullopt;
  }
  for (auto it = by_order_.begin(); it != by_order_.end(); ++it) {
    const Waiting& waiting = it->second;
    if (!waiting.sent_us || now_us - *waiting.sent_us >= kRepeat_us) {
      const AnchorId id = waiting.id;
      by_order_.erase(it);
      by_order_[++last_order_] = {id, now_us};
      order_of_[id] = last_order_;
      return id;
    }
  }
  return std::nullopt;
}

}  // namespace pangea
