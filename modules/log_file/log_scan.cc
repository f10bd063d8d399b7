#include "log_file/log_scan.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <stdexcept>

#include "files/disk_io.h"

namespace pangea {
namespace {

constexpr size_t kReadAhead = 1 << 20;

constexpr std::array<uint8_t, 4> kMagicBytes = {
    static_cast<uint8_t>(kLogMagic >> 24), static_cast<uint8_t>(kLogMagic >> 16 & 0xff),
    static_cast<uint8_t>(kLogMagic >> 8 & 0xff), static_cast<uint8_t>(kLogMagic & 0xff)};

// The first byte from `offset` on that the disk does not give, to the size of a sector.
int64_t FirstUnreadable(int fd, int64_t offset) {
  std::array<uint8_t, 512> sector{};
  while (ReadFully(fd, offset, sector.data(), sector.size())) {
    offset += static_cast<int64_t>(sector.size());
  }
  return offset;
}

}  // namespace

LogScan::LogScan(int fd) : fd_(fd) {
  struct stat info {};
  if (fstat(fd, &info) != 0) {
    throw std::runtime_error(std::strerror(errno));
  }
  file_bytes_ = info.st_size;
}

Bytes LogScan::Peek(int64_t offset, size_t size) {
  const int64_t window_end = window_offset_ + static_cast<int64_t>(window_.size());
  const int64_t want_end = std::min(offset + static_cast<int64_t>(size), file_bytes_);
  if (offset < window_offset_ || want_end > window_end) {
    const auto left = static_cast<size_t>(std::max<int64_t>(file_bytes_ - offset, 0));
    window_.resize(std::min(std::max(size, kReadAhead), left));
    window_offset_ = offset;
    if (!ReadFully(fd_, offset, window_.data(), window_.size())) {
      const int error = errno;
      throw std::runtime_error(error != 0 ? fmt::format("{} at byte {}", std::strerror(error),
                                                        FirstUnreadable(fd_, offset))
                                          : "the file has become shorter");
    }
  }
  return Bytes(window_).subspan(static_cast<size_t>(offset - window_offset_));
}

std::optional<LogEventHeader> LogScan::EventAt(int64_t offset) {
  const auto header = ParseLogEventHeader(Peek(offset, LogEventHeader::kBytes));
  if (!header || header->event_bytes() > file_bytes_ - offset) {
    return std::nullopt;
  }
  const auto name_bytes = static_cast<size_t>(header->channel_bytes);
  const Bytes name =
      Peek(offset, LogEventHeader::kBytes + name_bytes).subspan(LogEventHeader::kBytes, name_bytes);
  return std::all_of(name.begin(), name.end(), [](uint8_t c) { return std::isgraph(c) != 0; })
             ? header
             : std::nullopt;
}

int64_t LogScan::NextMagic(int64_t from, int64_t to) {
  while (from < to) {
    const Bytes window = Peek(from, kMagicBytes.size());
    const auto found =
        std::search(window.begin(), window.end(), kMagicBytes.begin(), kMagicBytes.end());
    if (found != window.end()) {
      const int64_t at = from + (found - window.begin());
      return at < to ? at : -1;
    }
    if (window.size() < kMagicBytes.size()) {
      return -1;
    }
    from += static_cast<int64_t>(window.size() - kMagicBytes.size() + 1);
  }
  return -1;
}

int64_t LogScan::NextEvent(int64_t from, int64_t to) {
  int64_t at = NextMagic(from, to);
  while (at >= 0 && !EventAt(at)) {
    at = NextMagic(at + 1, to);
  }
  return at;
}

bool LogScan::IsWhole(int64_t offset, const LogEventHeader& header) {
  const int64_t end = offset + header.event_bytes();
  return end == file_bytes_ || EventAt(end) || NextEvent(offset + 1, end) < 0;
}

LogPiece LogScan::Event(const LogEventHeader& header) {
  LogPiece piece;
  piece.offset = at_;
  piece.bytes = header.event_bytes();
  piece.header = header;
  piece.whole = Peek(at_, static_cast<size_t>(piece.bytes)).first(static_cast<size_t>(piece.bytes));
  const auto channel_bytes = static_cast<size_t>(header.channel_bytes);
  const Bytes name = piece.whole.subspan(LogEventHeader::kBytes, channel_bytes);
  piece.channel.assign(name.begin(), name.end());
  piece.data = piece.whole.subspan(LogEventHeader::kBytes + channel_bytes);
  return piece;
}

// The bytes from here to the next event, or to the end of the file.
LogPiece LogScan::Gap() {
  LogPiece piece;
  piece.offset = at_;
  const int64_t next = NextEvent(at_ + 1, file_bytes_);
  piece.bytes = (next >= 0 ? next : file_bytes_) - at_;
  const bool torn = next < 0 && NextMagic(at_ + 1, file_bytes_) < 0;
  piece.kind = torn ? LogPiece::Kind::kTornTail : LogPiece::Kind::kDamage;
  return piece;
}

std::optional<LogPiece> LogScan::Next() {
  if (at_ >= file_bytes_) {
    return std::nullopt;
  }
  const auto header = EventAt(at_);
  LogPiece piece = header && IsWhole(at_, *header) ? Event(*header) : Gap();
  at_ = piece.end();
  return piece;
}

}  // namespace pangea
