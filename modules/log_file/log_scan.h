#pragma once

// Reads a file in LCM's log format event by event, and goes on behind damage.
//
// An event is taken when its header makes sense and the next event, or the end of the file, follows
// it. If neither does, one of the two headers is damaged: it is the first if an event begins inside
// what it claims to be long, else the second. Damage ends at the next whole event. What stands
// behind the last whole event is a torn tail, as a crash leaves it, only if no event's magic number
// is in it.
//
// What a flipped bit did to a payload no header tells: checksums.h. One thread.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "bus/bus.h"
#include "log_file/log_event.h"

namespace pangea {

struct LogPiece {
  enum class Kind { kEvent, kDamage, kTornTail };
  Kind kind = Kind::kEvent;
  int64_t offset = 0;  // in the file
  int64_t bytes = 0;
  // Of an event, valid until the next call:
  LogEventHeader header;
  std::string channel;
  Bytes whole;  // header, channel and data
  Bytes data;

  int64_t end() const { return offset + bytes; }
  int64_t data_offset() const { return end() - header.data_bytes; }
};

class LogScan {
 public:
  // `fd`: open for reading, and stays the caller's. Its length is what it is now.
  explicit LogScan(int fd);
  // The part of it from `begin`, where an event begins, to `end`, where one ends.
  LogScan(int fd, int64_t begin, int64_t end) : fd_(fd), file_bytes_(end), at_(begin) {}

  // The pieces of the file in order, without gaps; nothing at its end. Throws std::runtime_error
  // if the file cannot be read.
  std::optional<LogPiece> Next();
  int64_t file_bytes() const { return file_bytes_; }  // or the part's end

 private:
  // The file from there on, at least `size` bytes of it but at its end. Valid until the next call.
  Bytes Peek(int64_t offset, size_t size);
  // The header at `offset`, if a whole event seems to begin there.
  std::optional<LogEventHeader> EventAt(int64_t offset);
  // Where the first of them begins in [from, to); -1 for nowhere.
  int64_t NextEvent(int64_t from, int64_t to);
  // Where the magic number stands next in [from, to); -1 for nowhere.
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
