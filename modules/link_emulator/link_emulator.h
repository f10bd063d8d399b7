#pragma once

// One direction of a bad link: (time, packet) goes in, (delivery time, packet) comes out.
//
// What happens to a packet depends on the seed, the direction and the number of packets before it,
// never on the clock; so it is the same in every run. Only partitions depend on time: packets that
// come in during a partition are lost, packets under way still arrive.
//
// A packet chosen for reordering is held back until 1 .. kMaxOvertakers later packets have
// overtaken it, or for kLongestHold_us if none follow.
//
// Bounded: at most kMaxQueuedBytes are under way; a packet that does not fit is dropped, as a full
// router would do.
//
// A state machine: microseconds since the link came up go in, and must not decrease; no clock, no
// bus; not thread safe.

#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "core/bytes.h"
#include "link_emulator/link_conditions.h"

namespace pangea {

enum class LinkDirection : uint8_t { kUp = 0, kDown = 1 };

class LinkEmulator {
 public:
  static constexpr int64_t kMaxQueuedBytes = 32 << 20;  // 4 MB/s for 8 s
  static constexpr int kMaxOvertakers = 8;
  static constexpr int64_t kLongestHold_us = 250'000;

  struct Delivery {
    int64_t at_us = 0;
    std::vector<uint8_t> packet;
  };

  // Packets since the start: taken = lost + cut + overflowed + (delivered or under way) - doubled.
  struct Counts {
    int64_t taken = 0;
    int64_t delivered = 0;
    int64_t lost = 0;        // by chance
    int64_t cut = 0;         // by a partition
    int64_t overflowed = 0;  // did not fit; copies of packets that did not fit are not counted
    int64_t doubled = 0;
    int64_t reordered = 0;
  };

  LinkEmulator(LinkConditions conditions, LinkDirection direction);

  void Add(int64_t now_us, Bytes packet);
  // The packets to deliver by now, in order of delivery.
  std::vector<Delivery> TakeDue(int64_t now_us);
  std::optional<int64_t> next_due_us() const;

  const Counts& counts() const { return counts_; }
  size_t under_way() const { return queue_.size(); }
  // Of these, the packets held back that too few others have overtaken yet.
  size_t held_back() const { return held_.size(); }

 private:
  // (delivery time, order of arrival).
  using Place = std::pair<int64_t, int64_t>;
  enum class Draw : uint8_t { kLoss, kDuplicate, kReorder, kOvertakers, kJitter, kCopyJitter };
  struct Held {
    Place place;
    int overtakers = 0;
  };

  // A random number of the newest packet, uniform in [0, 1).
  double Uniform(Draw draw) const;
  bool Partitioned(int64_t now_us) const;
  int64_t Delay_us(Draw jitter) const;
  bool Fits(Bytes packet) const;
  Place Enqueue(int64_t at_us, Bytes packet);
  // A packet with this delivery time overtakes the packets that are held back.
  void Overtake(int64_t at_us);

  const LinkConditions conditions_;
  const LinkDirection direction_;
  Counts counts_;
  std::map<Place, std::vector<uint8_t>> queue_;
  std::vector<Held> held_;  // each is in queue_
  int64_t queued_bytes_ = 0;
  int64_t next_order_ = 0;
};

}  // namespace pangea
