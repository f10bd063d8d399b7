#pragma once

// Checksums of a log's events, written into the same log as events of their own (CHECKSUMS,
// checksums_t) behind those they are of: any LCM tool still reads the file, and whoever copies it
// takes them along. A list is of the events right before it, by their numbers, and has a checksum
// of its own: one that is damaged, or that was copied into another log, counts for nothing.

#include <cstdint>
#include <optional>
#include <vector>

#include "bus/bus.h"

namespace pangea {

struct Checksums {
  // An event has this many others' at most.
  static constexpr size_t kMax = 100'000;
  int64_t first_event = 0;      // its number
  std::vector<uint32_t> crc32;  // of it and those that follow

  // The number of the CHECKSUMS event.
  int64_t event_number() const { return first_event + static_cast<int64_t>(crc32.size()); }
};

// Of a whole event: header, channel and data.
uint32_t EventChecksum(Bytes event);

// The CHECKSUMS event of these.
void AppendChecksumsEvent(const Checksums& checksums, int64_t utime, std::vector<uint8_t>* out);
// What a whole event says if it is one, and in its place.
std::optional<Checksums> ChecksumsOf(Bytes event);

}  // namespace pangea
