#pragma once

// What a link does to packets, the same in both directions.

#include <cstdint>
#include <string>
#include <vector>

namespace pangea {

struct LinkPartition {
  double at_s = 0;     // since the link came up
  double seconds = 0;  // nothing passes for so long
};

struct LinkConditions {
  double loss = 0;       // share of packets that never arrive, 0 .. 1
  double delay_ms = 0;   // of every packet, one way
  double jitter_ms = 0;  // further delay, uniform from 0 to this: packets closer than it may swap
  double reorder = 0;    // share of packets that are held back until later ones have gone first
  double duplicate = 0;  // share of packets that arrive twice
  std::vector<LinkPartition> partitions;
  uint64_t seed = 1;  // of every decision
};

// "loss 5 %, delay 50 ms": what differs from a perfect link, for people.
std::string Describe(const LinkConditions& conditions);

}  // namespace pangea
