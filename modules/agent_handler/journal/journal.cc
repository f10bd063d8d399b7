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
#include <stdexcept>

#include "log_file/log_event.h"

namespace pangea {

Journal::Journal(const std::string& path, const Visitor& visitor) : path_(path) {
  fd_ = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  if (fd_ < 0) {
    throw std::runtime_error(
        fmt::format("cannot open the journal '{}': {}", path, std::strerror(errno)));
  }
  try {
    if (flock(fd_, LOCK_EX | LOCK_NB) != 0) {
      throw std::runtime_error(fmt::format("the journal '{}' is in use by another process", path));
    }
    Load(visitor);
  } catch (...) {
    close(fd_);
    throw;
  }
  SyncFolder(std::filesystem::absolute(path).parent_path());
}

Journal::~Journal() {
  Sync();
  close(fd_);
}

void Journal::Load(const Visitor& visitor) {
  struct stat info {};
  if (fstat(fd_, &info) != 0) {
    throw std::runtime_error(
        fmt::format("cannot read the journal '{}': {}", path_, std::strerror(errno)));
  }
  const int64_t file_bytes = info.st_size;
  std::vector<uint8_t> body, start(LogEventHeader::kBytes);
  while (synced_bytes_ < file_bytes) {
    if (!ReadFully(fd_, synced_bytes_, start.data(), start.size())) {
      break;
    }
    const auto header = ParseLogEventHeader(start);
    if (!header) {
      break;
    }
    const int64_t body_offset = synced_bytes_ + static_cast<int64_t>(LogEventHeader::kBytes);
    body.resize(static_cast<size_t>(header->event_bytes()) - LogEventHeader::kBytes);
    if (!ReadFully(fd_, body_offset, body.data(), body.size())) {
      break;
    }
    const std::string channel(body.begin(), body.begin() + header->channel_bytes);
    const bool good = visitor(channel, Bytes(body).subspan(channel.size()),
                              {body_offset + header->channel_bytes, header->data_bytes});
    // Pages of the last writes may have reached the disk in any order: damage there is a torn tail.
    if (!good && file_bytes - synced_bytes_ <= kMaxTornBytes) {
      break;
    }
    next_event_ = header->number + 1;
    synced_bytes_ += header->event_bytes();
  }
  cut_bytes_ = file_bytes - synced_bytes_;
  if (cut_bytes_ > kMaxTornBytes) {
    throw std::runtime_error(fmt::format(
        "the journal '{}' is damaged at byte {} of {}: that is no torn tail; repair it, "
        "or cut it there by hand (truncate -s {})",
        path_, synced_bytes_, file_bytes, synced_bytes_));
  }
  if (cut_bytes_ > 0 && (ftruncate(fd_, synced_bytes_) != 0 || fdatasync(fd_) != 0)) {
    throw std::runtime_error(
        fmt::format("cannot cut the journal '{}': {}", path_, std::strerror(errno)));
  }
}

JournalPlace Journal::Append(int64_t utime, const std::string& channel, Bytes data) {
  const size_t begin = AppendLogEvent(next_event_++, utime, channel, data, &queue_);
  return {synced_bytes_ + static_cast<int64_t>(begin), static_cast<int32_t>(data.size())};
}

bool Journal::Sync() {
  if (queue_.empty()) {
    return true;
  }
  if (!WriteFully(fd_, synced_bytes_, queue_.data(), queue_.size()) || fdatasync(fd_) != 0) {
    // The part that was written is overwritten by the next try.
    return false;
  }
  synced_bytes_ += static_cast<int64_t>(queue_.size());
  queue_.clear();
  return true;
}

std::vector<uint8_t> Journal::Read(const JournalPlace& place) const {
  std::vector<uint8_t> data(static_cast<size_t>(place.size));
  if (place.offset >= synced_bytes_) {
    const auto begin = static_cast<size_t>(place.offset - synced_bytes_);
    if (begin + data.size() > queue_.size()) {
      return {};
    }
    std::copy_n(queue_.begin() + static_cast<int64_t>(begin), data.size(), data.begin());
    return data;
  }
  return ReadFully(fd_, place.offset, data.data(), data.size()) ? data : std::vector<uint8_t>{};
}

}  // namespace pangea
