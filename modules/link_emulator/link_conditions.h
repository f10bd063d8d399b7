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

  // Of an agent's `link:` in a session file, and of the emulator's own file.
  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Add("loss", &loss, {0, 1}, "", "share of packets that never arrive");
    archive.Add("delay_ms", &delay_ms, {0, 60'000}, "ms", "of every packet, one way");
    archive.Add("jitter_ms", &jitter_ms, {0, 60'000}, "ms", "further delay, at random");
    archive.Add("reorder", &reorder, {0, 1}, "", "share of packets that later ones overtake");
    archive.Add("duplicate", &duplicate, {0, 1}, "", "share of packets that arrive twice");
    archive.AddList("partitions", &partitions, [](auto& item, LinkPartition& partition) {
      item.Add("at", &partition.at_s, {0, 1e6}, "s", "since the link came up");
      item.Require("at");
      item.Add("seconds", &partition.seconds, {0, 1e6}, "s", "nothing passes for so long");
      item.Require("seconds");
    });
    archive.Add("seed", &seed);
  }
};

// "loss 5 %, delay 50 ms": what differs from a perfect link, for people.
std::string Describe(const LinkConditions& conditions);

}  // namespace pangea
