#pragma once

// Checksums of a log's events. They are events in the same log (CHECKSUMS, checksums_t), so any LCM
// tool can still read the file, and a copy contains them. A CHECKSUMS event is for the events right
// before it, by their numbers, and has a checksum of its own. It is ignored if it is damaged or was
// copied into another log.

#include <cstdint>
#include <optional>
#include <vector>

#include "core/bytes.h"

namespace pangea {

struct Checksums {
  // Largest number of checksums in one event.
  static constexpr size_t kMax = 100'000;
  int64_t first_event = 0;      // number of the first event that has a checksum here
  std::vector<uint32_t> crc32;  // of that event and those that follow it

  // The number of the CHECKSUMS event.
  int64_t event_number() const { return first_event + static_cast<int64_t>(crc32.size()); }
};

// CRC-32 of a whole event: header, channel and data.
uint32_t EventChecksum(Bytes event);

// Appends the bytes of the CHECKSUMS event with these checksums to `out`.
void AppendChecksumsEvent(const Checksums& checksums, int64_t utime, std::vector<uint8_t>* out);
// Parses a whole CHECKSUMS event. Nothing if it is not one, is damaged, or has another number than
// its place in the log requires.
std::optional<Checksums> ChecksumsOf(Bytes event);

}  // namespace pangea
