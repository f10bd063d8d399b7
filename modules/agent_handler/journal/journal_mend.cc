#include "agent_handler/journal/journal_mend.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>

#include "files/disk_io.h"
#include "log_file/log_event.h"
#include "messages/channels.h"

namespace pangea {
namespace {

// An event with one letter of the channel's name and no data.
constexpr int64_t kMinEventBytes = static_cast<int64_t>(LogEventHeader::kBytes) + 1;

int64_t Size(const DamagedPart& part) { return part.range.end - part.range.begin; }

bool IsFilled(int fd, const DamagedPart& part) {
  std::vector<uint8_t> bytes(static_cast<size_t>(Size(part)));
  return Size(part) < kMinEventBytes &&
         ReadFully(fd, part.range.begin, bytes.data(), bytes.size()) &&
         std::ranges::all_of(bytes, [](uint8_t byte) { return byte == 0; });
}

// Writes the header of a DAMAGED event of `size` bytes at `offset`; the bytes after the header stay
// as its data.
bool WriteDamagedEvent(int fd, int64_t offset, int64_t size, const DamagedPart& part) {
  const auto header_bytes = static_cast<int64_t>(LogEventHeader::kBytes);
  const auto name = channels::kDamaged.substr(0, static_cast<size_t>(size - header_bytes));
  std::vector<uint8_t> event;
  AppendLogEvent(part.event_number, part.utime, std::string(name), {}, &event);
  const int64_t data_bytes = size - static_cast<int64_t>(event.size());
  for (int i = 0; i < 4; ++i) {  // the header's last field: the number of data bytes
    event[LogEventHeader::kBytes - 4 + static_cast<size_t>(i)] =
        static_cast<uint8_t>(data_bytes >> (24 - 8 * i));
  }
  return WriteFully(fd, offset, event.data(), event.size());
}

bool Fill(int fd, const DamagedPart& part) {
  if (Size(part) < kMinEventBytes) {
    const std::vector<uint8_t> zeros(static_cast<size_t>(Size(part)));
    return WriteFully(fd, part.range.begin, zeros.data(), zeros.size());
  }
  for (int64_t at = part.range.begin; at < part.range.end;) {
    const int64_t left = part.range.end - at;
    const int64_t size = left <= LogEventHeader::kMaxDataBytes
                             ? left
                             : LogEventHeader::kMaxDataBytes - kMinEventBytes;
    if (!WriteDamagedEvent(fd, at, size, part)) {
      return false;
    }
    at += size;
  }
  return true;
}

}  // namespace

std::string JournalMend::Said(const std::string& journal) const {
  if (copy.empty()) {
    return "";
  }
  std::string said = fmt::format("the journal '{}'", journal);
  if (damaged_bytes > 0) {
    said += fmt::format(
        " WAS DAMAGED: {} bytes in {} places are no events any more, all else is "
        "read",
        damaged_bytes, damaged_parts);
  }
  if (torn_bytes > 0) {
    said += fmt::format("{} ended with {} bytes of an event that was not written to its end",
                        damaged_bytes > 0 ? "; it" : "", torn_bytes);
  }
  return said + fmt::format("; they are kept in '{}', agents are asked for them again", copy);
}

JournalMend MendJournal(const std::string& path, int fd, std::vector<DamagedPart> parts,
                        int64_t* file_bytes, const std::function<void()>& before_mend) {
  std::erase_if(parts, [&](const DamagedPart& part) {
    return part.range.end < *file_bytes && IsFilled(fd, part);
  });
  JournalMend mend;
  if (parts.empty()) {
    return mend;
  }
  std::vector<FileRange> ranges;
  for (const DamagedPart& part : parts) {
    ranges.push_back(part.range);
    (part.torn ? mend.torn_bytes : mend.damaged_bytes) += Size(part);
    mend.damaged_parts += part.torn ? 0 : 1;
  }
  mend.copy = KeepDamaged(path, fd, ranges);
  if (mend.damaged_bytes > 0 && before_mend) {
    before_mend();
  }
  int64_t end = *file_bytes;
  for (; !parts.empty() && parts.back().range.end == end; parts.pop_back()) {
    end = parts.back().range.begin;
  }
  const auto fill = [fd](const DamagedPart& part) { return Fill(fd, part); };
  const bool cut = end == *file_bytes || ftruncate(fd, end) == 0;
  if (!cut || !std::ranges::all_of(parts, fill) || fdatasync(fd) != 0) {
    throw std::runtime_error(
        fmt::format("cannot mend the journal '{}': {}; what was damaged is in '{}'", path,
                    std::strerror(errno), mend.copy));
  }
  *file_bytes = end;
  return mend;
}

}  // namespace pangea
