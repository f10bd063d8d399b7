#pragma once

// LCM's log format, for code that reads and writes files without LCM's own LogFile. LogFile cannot
// tell the offset of an event, and cannot overwrite a part that the disk failed to write.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/bytes.h"

namespace pangea {

// The first four bytes of each event.
inline constexpr uint32_t kLogMagic = 0xEDA1DA01;

struct LogEventHeader {
  static constexpr size_t kBytes = 28;
  static constexpr int64_t kMaxDataBytes = 16 << 20;
  int64_t number = 0;  // of the event in its file, from 0
  int64_t utime = 0;   // when the event was captured, wall clock, microseconds
  int32_t channel_bytes = 0;
  int32_t data_bytes = 0;

  int64_t event_bytes() const { return static_cast<int64_t>(kBytes) + channel_bytes + data_bytes; }
};

// Appends header, channel and data of an event; returns the index in `out` where the data begins.
size_t AppendLogEvent(int64_t number, int64_t utime, const std::string& channel, Bytes data,
                      std::vector<uint8_t>* out);
// Nothing if the bytes are not an event's header, or if its lengths are absurd.
std::optional<LogEventHeader> ParseLogEventHeader(Bytes bytes);
// Whether the `bytes` bytes from `offset` on may be the first bytes of an event. If there are fewer
// than four, only these are compared.
bool BeginsAsLogEvent(int fd, int64_t offset, int64_t bytes);
}  // namespace pangea
