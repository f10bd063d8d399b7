#pragma once

// The faults that an emulated link has; they are the same in both directions.

#include <cstdint>
#include <string>
#include <vector>

namespace pangea {

struct LinkPartition {
  double at_s = 0;     // begin, in seconds since the link came up
  double seconds = 0;  // duration, during which all packets are lost
};

struct LinkConditions {
  double loss = 0;       // share of packets that never arrive, 0 .. 1
  double delay_ms = 0;   // one-way delay of every packet
  double jitter_ms = 0;  // additional delay, uniform from 0 to this; so close packets may swap
  double reorder = 0;    // share of packets that are held back until later ones overtook them
  double duplicate = 0;  // share of packets that arrive twice
  std::vector<LinkPartition> partitions;
  uint64_t seed = 1;  // of all random decisions

  // Used for an agent's `link:` in a session file and for the emulator's options file.
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

// For people, the differences from a perfect link, such as "loss 5 %, delay 50 ms".
std::string Describe(const LinkConditions& conditions);

}  // namespace pangea
