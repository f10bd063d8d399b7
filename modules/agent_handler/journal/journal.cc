#include "agent_handler/journal/journal.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <limits>
#include <stdexcept>

#include "files/disk_io.h"
#include "log_file/checksums.h"
#include "log_file/log_event.h"
#include "messages/channels.h"

namespace pangea {
namespace {

bool IsOwn(const LogPiece& event) {
  return event.channel == channels::kChecksums || FillsDamage(event);
}

// Throws unless the journal is a regular file or a character device. A device such as /dev/full has
// no end to append to, but also nothing to lose. Anything else is not written to.
void CheckKind(const std::string& path, int fd) {
  struct stat info {};
  if (fstat(fd, &info) != 0 || !(S_ISREG(info.st_mode) || S_ISCHR(info.st_mode))) {
    throw std::runtime_error(fmt::format(
        "the journal '{}' is no file: give the name of a file, new or a journal", path));
  }
}

// Whether the path still names the open file.
bool Names(const std::string& path, int fd) {
  struct stat opened = {}, named = {};
  return fstat(fd, &opened) == 0 && stat(path.c_str(), &named) == 0 &&
         opened.st_ino == named.st_ino && opened.st_dev == named.st_dev;
}

int64_t SizeOf(const std::vector<DamagedPart>& parts) {
  int64_t size = 0;
  for (const DamagedPart& part : parts) {
    size += part.range.end - part.range.begin;
  }
  return size;
}

}  // namespace

Journal::Journal(const std::string& path, const Visitor& visitor,
                 const std::function<void()>& before_mend)
    : path_(path) {
  fd_ = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  if (fd_ < 0) {
    throw std::runtime_error(
        fmt::format("cannot open the journal '{}': {}", path, std::strerror(errno)));
  }
  try {
    CheckKind(path, fd_);
    if (flock(fd_, LOCK_EX | LOCK_NB) != 0) {
      throw std::runtime_error(fmt::format("the journal '{}' is in use by another process", path));
    }
    if (!Names(path, fd_)) {
      throw std::runtime_error(
          fmt::format("the journal '{}' was replaced just now: start again", path));
    }
    Load(visitor, before_mend);
    // A run that was killed may not have waited for the disk.
    if (synced_bytes_ > 0 && fdatasync(fd_) != 0) {
      throw std::runtime_error(fmt::format("the journal '{}' cannot be brought to the disk: {}",
                                           path, std::strerror(errno)));
    }
  } catch (...) {
    close(fd_);
    throw;
  }
  TrySyncToDisk(std::filesystem::absolute(path).parent_path());
}

Journal::~Journal() {
  Sync();
  close(fd_);
}

void Journal::Load(const Visitor& visitor, const std::function<void()>& before_mend) {
  std::vector<DamagedPart> parts;
  try {
    parts = Scan(visitor);
  } catch (const std::runtime_error& error) {
    // Nothing is written: a cable may be loose, and a disk that fails may lose more by it.
    throw std::runtime_error(fmt::format(
        "cannot read the journal '{0}': {1}: nothing was changed; if it stays so, put a "
        "copy in its place (dd if='{0}' of=COPY bs=4096 conv=noerror,sync): only what "
        "cannot be read is lost, and agents send again what they have",
        path_, error.what()));
  }
  const bool has_events = SizeOf(parts) < synced_bytes_;
  if (synced_bytes_ > 0 && !has_events && !BeginsAsLogEvent(fd_, 0, synced_bytes_)) {
    throw std::runtime_error(
        fmt::format("'{}' is no journal, and is left as it is: give another name; if it was one, "
                    "move it away, and agents send again what they have",
                    path_));
  }
  mend_ = MendJournal(path_, fd_, std::move(parts), &synced_bytes_, before_mend);
}

// Reads the file, gives its events to the visitor, and returns the parts that are no valid events.
std::vector<DamagedPart> Journal::Scan(const Visitor& visitor) {
  std::vector<DamagedPart> parts;
  CheckedScan scan(fd_);
  while (const CheckedScan::Piece* piece = scan.Next()) {
    if (piece->kind == LogPiece::Kind::kEvent && Take(*piece, visitor)) {
      if (parts.size() == 1 && parts[0].range.begin == 0 && parts[0].range.end == piece->offset) {
        parts[0].utime = last_utime_;
      }
      continue;
    }
    newest_crc32_.clear();
    const bool torn = piece->kind == LogPiece::Kind::kTornTail &&
                      BeginsAsLogEvent(fd_, piece->offset, piece->bytes);
    if (!parts.empty() && !torn && parts.back().range.end == piece->offset) {
      parts.back().range.end = piece->end();
    } else {
      parts.push_back({{piece->offset, piece->end()}, torn, next_event_, last_utime_});
    }
  }
  synced_bytes_ = scan.file_bytes();
  return parts;
}

bool Journal::Take(const CheckedScan::Piece& piece, const Visitor& visitor) {
  if (!IsOwn(piece) && !visitor(piece.channel, piece.data,
                                {piece.offset, static_cast<int32_t>(piece.bytes), piece.crc32()})) {
    return false;
  }
  Note(piece.header.number, piece.header.utime, piece.crc32());
  last_event_ = {piece.offset, static_cast<int32_t>(piece.bytes), piece.crc32()};
  KeepNewest(kRepeated);
  return true;
}

void Journal::Note(int64_t number, int64_t utime, uint32_t crc32) {
  constexpr int64_t kMaxNumber = std::numeric_limits<int64_t>::max() / 2;
  if (number != next_event_) {
    newest_crc32_.clear();
    next_event_ = std::clamp<int64_t>(number, 0, kMaxNumber);
  }
  ++next_event_;
  last_utime_ = utime;
  newest_crc32_.push_back(crc32);
}

void Journal::KeepNewest(size_t count) {
  while (newest_crc32_.size() > count) {
    newest_crc32_.pop_front();
  }
}

JournalPlace Journal::Append(int64_t utime, const std::string& channel, Bytes data) {
  const size_t begin = queue_.size();
  AppendLogEvent(next_event_, utime, channel, data, &queue_);
  const Bytes event = Bytes(queue_).subspan(begin);
  const JournalPlace place = {synced_bytes_ + static_cast<int64_t>(begin),
                              static_cast<int32_t>(event.size()), EventChecksum(event)};
  Note(next_event_, utime, place.crc32);
  return place;
}

bool Journal::Sync() {
  if (queue_.empty()) {
    return true;
  }
  const size_t queued = queue_.size();
  KeepNewest(Checksums::kMax);
  const Checksums checksums{next_event_ - static_cast<int64_t>(newest_crc32_.size()),
                            {newest_crc32_.begin(), newest_crc32_.end()}};
  AppendChecksumsEvent(checksums, last_utime_, &queue_);
  if (!WriteFully(fd_, synced_bytes_, queue_.data(), queue_.size()) || fdatasync(fd_) != 0) {
    // The next try overwrites the part that was written.
    queue_.resize(queued);
    return false;
  }
  last_event_ = {synced_bytes_ + static_cast<int64_t>(queued),
                 static_cast<int32_t>(queue_.size() - queued),
                 EventChecksum(Bytes(queue_).subspan(queued))};
  Note(next_event_, last_utime_, last_event_.crc32);
  KeepNewest(kRepeated);
  synced_bytes_ += static_cast<int64_t>(queue_.size());
  queue_.clear();
  return true;
}

std::vector<uint8_t> Journal::Read(const JournalPlace& place) const {
  std::vector<uint8_t> event(static_cast<size_t>(place.size));
  if (place.offset >= synced_bytes_) {
    const auto begin = static_cast<size_t>(place.offset - synced_bytes_);
    if (begin + event.size() > queue_.size()) {
      return {};
    }
    std::copy_n(queue_.begin() + static_cast<int64_t>(begin), event.size(), event.begin());
  } else if (!ReadFully(fd_, place.offset, event.data(), event.size())) {
    return {};
  }
  const auto header = ParseLogEventHeader(event);
  if (!header || header->event_bytes() != place.size || EventChecksum(event) != place.crc32) {
    return {};
  }
  return {event.end() - header->data_bytes, event.end()};
}

}  // namespace pangea
