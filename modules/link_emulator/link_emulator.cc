#include "link_emulator/link_emulator.h"

#include <algorithm>
#include <cmath>

namespace pangea {
namespace {

// splitmix64 (Steele, Lea, Flood 2014): neighbouring inputs give unrelated outputs.
uint64_t Mixed(uint64_t value) {
  value += 0x9e3779b97f4a7c15;
  value = (value ^ (value >> 30)) * 0xbf58476d1ce4e5b9;
  value = (value ^ (value >> 27)) * 0x94d049bb133111eb;
  return value ^ (value >> 31);
}

}  // namespace

LinkEmulator::LinkEmulator(LinkConditions conditions, LinkDirection direction)
    : conditions_(std::move(conditions)), direction_(direction) {}

double LinkEmulator::Uniform(Draw draw) const {
  const uint64_t stream = Mixed(Mixed(conditions_.seed) + static_cast<uint64_t>(direction_));
  const uint64_t packet = Mixed(stream + static_cast<uint64_t>(counts_.taken));
  return std::ldexp(static_cast<double>(Mixed(packet + static_cast<uint64_t>(draw)) >> 11), -53);
}

bool LinkEmulator::Partitioned(int64_t now_us) const {
  const double now_s = 1e-6 * static_cast<double>(now_us);
  return std::ranges::any_of(conditions_.partitions, [now_s](const LinkPartition& partition) {
    return now_s >= partition.at_s && now_s < partition.at_s + partition.seconds;
  });
}

int64_t LinkEmulator::Delay_us(Draw jitter) const {
  return std::llround(1e3 * (conditions_.delay_ms + conditions_.jitter_ms * Uniform(jitter)));
}

bool LinkEmulator::Fits(Bytes packet) const {
  return queued_bytes_ + static_cast<int64_t>(packet.size()) <= kMaxQueuedBytes;
}

LinkEmulator::Place LinkEmulator::Enqueue(int64_t at_us, Bytes packet) {
  const Place place{at_us, next_order_++};
  queue_.emplace(place, std::vector<uint8_t>(packet.begin(), packet.end()));
  queued_bytes_ += static_cast<int64_t>(packet.size());
  return place;
}

void LinkEmulator::Overtake(int64_t at_us) {
  for (Held& held : held_) {
    if (--held.overtakers > 0) {
      continue;
    }
    auto node = queue_.extract(held.place);
    node.key() = {std::min(held.place.first, at_us), next_order_++};
    queue_.insert(std::move(node));
  }
  std::erase_if(held_, [](const Held& held) { return held.overtakers <= 0; });
}

void LinkEmulator::Add(int64_t now_us, Bytes packet) {
  ++counts_.taken;
  if (Partitioned(now_us)) {
    ++counts_.cut;
  } else if (Uniform(Draw::kLoss) < conditions_.loss) {
    ++counts_.lost;
  } else if (!Fits(packet)) {
    ++counts_.overflowed;
  } else {
    const int64_t at_us = now_us + Delay_us(Draw::kJitter);
    if (Uniform(Draw::kReorder) < conditions_.reorder) {
      ++counts_.reordered;
      const int overtakers = 1 + static_cast<int>(kMaxOvertakers * Uniform(Draw::kOvertakers));
      held_.push_back({Enqueue(at_us + kLongestHold_us, packet), overtakers});
    } else {
      Enqueue(at_us, packet);
      Overtake(at_us);
    }
    if (Uniform(Draw::kDuplicate) < conditions_.duplicate && Fits(packet)) {
      ++counts_.doubled;
      Enqueue(now_us + Delay_us(Draw::kCopyJitter), packet);
    }
  }
}

std::vector<LinkEmulator::Delivery> LinkEmulator::TakeDue(int64_t now_us) {
  std::vector<Delivery> due;
  while (!queue_.empty() && queue_.begin()->first.first <= now_us) {
    auto node = queue_.extract(queue_.begin());
    queued_bytes_ -= static_cast<int64_t>(node.mapped().size());
    ++counts_.delivered;
    due.push_back({node.key().first, std::move(node.mapped())});
  }
  std::erase_if(held_, [this](const Held& held) { return !queue_.contains(held.place); });
  return due;
}

std::optional<int64_t> LinkEmulator::next_due_us() const {
  return queue_.empty() ? std::nullopt : std::optional(queue_.begin()->first.first);
}

}  // namespace pangea
