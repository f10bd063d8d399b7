#pragma once

// LCM's log format, for files that are written and read without LCM's own LogFile: which cannot say
// where an event lies, nor be told to write over a part that the disk refused.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "bus/bus.h"

namespace pangea {

// What each event begins with.
inline constexpr uint32_t kLogMagic = 0xEDA1DA01;

struct LogEventHeader {
  static constexpr size_t kBytes = 28;
  static constexpr int64_t kMaxDataBytes = 16 << 20;
  int64_t number = 0;  // of the event in its file
  int64_t utime = 0;
  int32_t channel_bytes = 0;
  int32_t data_bytes = 0;

  int64_t event_bytes() const { return static_cast<int64_t>(kBytes) + channel_bytes + data_bytes; }
};

// Appends header, channel and data; returns where the data begins in `out`.
size_t AppendLogEvent(int64_t number, int64_t utime, const std::string& channel, Bytes data,
                      std::vector<uint8_t>* out);
// Nothing if these bytes are no event's header, or one of absurd lengths.
std::optional<LogEventHeader> ParseLogEventHeader(Bytes bytes);
// All of it, going on after interruptions; false when the file refuses or ends.
bool ReadFully(int fd, int64_t offset, uint8_t* out, size_t size);
bool WriteFully(int fd, int64_t offset, const uint8_t* data, size_t size);
// Whether the file's `bytes` from there on may be the first of an event, however few they are.
bool BeginsAsLogEvent(int fd, int64_t offset, int64_t bytes);
// Makes a new file in the folder outlive a power cut; false if it may not.
bool SyncFolder(const std::string& folder);

}  // namespace pangea
