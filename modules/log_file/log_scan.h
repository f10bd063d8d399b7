#pragma once

// Reads a file in LCM's log format event by event, and continues after damage.
//
// An event is accepted when its header makes sense and the next event, or the end of the file,
// follows it. If neither follows, one of two headers is damaged: this event's, if another event
// begins within its claimed length, else that of the next event. Damage ends at the next whole
// event. Bytes after the last whole event are a torn tail, as a crash leaves it, only if no magic
// number is among them.
//
// A flipped bit in a payload cannot be found this way; see checksums.h. Not thread safe.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/bytes.h"
#include "log_file/log_event.h"

namespace pangea {

struct LogPiece {
  enum class Kind { kEvent, kDamage, kTornTail };
  Kind kind = Kind::kEvent;
  int64_t offset = 0;  // in the file
  int64_t bytes = 0;
  // Only for an event; valid until the next call:
  LogEventHeader header;
  std::string channel;
  Bytes whole;  // header, channel and data
  Bytes data;

  int64_t end() const { return offset + bytes; }
  int64_t data_offset() const { return end() - header.data_bytes; }
};

class LogScan {
 public:
  // `fd`: a file open for reading; the caller closes it. Reads up to the file's current size.
  explicit LogScan(int fd);
  // Reads only the part from `begin`, where an event begins, to `end`, where an event ends.
  LogScan(int fd, int64_t begin, int64_t end) : fd_(fd), file_bytes_(end), at_(begin) {}

  // The next piece of the file; the pieces follow one another without gaps. Nothing at the end.
  // Throws std::runtime_error if the file cannot be read.
  std::optional<LogPiece> Next();
  int64_t file_bytes() const { return file_bytes_; }  // size of the file, or `end` of the part

 private:
  // The file's bytes from `offset` on: at least `size`, or fewer at its end. Valid until the next
  // call.
  Bytes Peek(int64_t offset, size_t size);
  // The header at `offset`, if a whole event seems to begin there.
  std::optional<LogEventHeader> EventAt(int64_t offset);
  // Offset of the first event that begins in [from, to); -1: none.
  int64_t NextEvent(int64_t from, int64_t to);
  // Offset of the first magic number that begins in [from, to); -1: none.
  int64_t NextMagic(int64_t from, int64_t to);
  bool IsWhole(int64_t offset, const LogEventHeader& header);
  LogPiece Event(const LogEventHeader& header);
  LogPiece Gap();

  int fd_;
  int64_t file_bytes_ = 0;
  int64_t at_ = 0;
  std::vector<uint8_t> window_;
  int64_t window_offset_ = 0;
};

}  // namespace pangea
