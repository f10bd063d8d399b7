#pragma once

// Checksums of a log's events, written into the same log as events of their own (CHECKSUMS,
// checksums_t) behind those they are of: any LCM tool still reads the file, and whoever copies it
// takes them along.

#include <cstdint>
#include <optional>
#include <vector>

#include "common/bus/bus.h"

namespace pangea {

struct Checksums {
  // An event has this many others' at most.
  static constexpr size_t kMax = 100'000;
  int64_t first_event = 0;      // its number
  std::vector<uint32_t> crc32;  // of it and those that follow
};

// Of a whole event: header, channel and data.
uint32_t EventChecksum(Bytes event);

std::vector<uint8_t> EncodeChecksums(const Checksums& checksums);
// Nothing if these bytes are none.
std::optional<Checksums> DecodeChecksums(Bytes data);

}  // namespace pangea
