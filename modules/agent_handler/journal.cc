#include "agent_handler/journal.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <stdexcept>

namespace pangea {
namespace {

// LCM's log format, big-endian: magic, event number, time stamp, length of the channel's name and
// of the payload; then both.
constexpr uint32_t kMagic = 0xEDA1DA01;
constexpr size_t kHeaderBytes = 28;
constexpr uint32_t kMaxChannelName = 63;
constexpr uint32_t kMaxPayload = 16 << 20;
using Header = std::array<uint8_t, kHeaderBytes>;

void PutBigEndian(uint64_t value, int num_bytes, uint8_t* out) {
  for (int i = num_bytes - 1; i >= 0; --i, value >>= 8) {
    out[i] = static_cast<uint8_t>(value & 0xFF);
  }
}

uint64_t GetBigEndian(const uint8_t* in, int num_bytes) {
  uint64_t value = 0;
  for (int i = 0; i < num_bytes; ++i) {
    value = value << 8 | in[i];
  }
  return value;
}

bool ReadFully(int fd, int64_t offset, uint8_t* out, size_t size) {
  while (size > 0) {
    const ssize_t got = pread(fd, out, size, offset);
    if (got <= 0) {
      if (got < 0 && errno == EINTR) {
        continue;
      }
      return false;
    }
    out += got;
    offset += got;
    size -= static_cast<size_t>(got);
  }
  return true;
}

bool WriteFully(int fd, int64_t offset, const uint8_t* data, size_t size) {
  while (size > 0) {
    const ssize_t put = pwrite(fd, data, size, offset);
    if (put < 0) {
      if (errno == EINTR) {
        continue;
      }
      return false;
    }
    data += put;
    offset += put;
    size -= static_cast<size_t>(put);
  }
  return true;
}

// A file that is new is only safe once its directory is.
void SyncFolder(const std::string& path) {
  const std::filesystem::path folder = std::filesystem::absolute(path).parent_path();
  const int fd = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd >= 0) {
    fsync(fd);
    close(fd);
  }
}

}  // namespace

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
  SyncFolder(path);
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
  std::vector<uint8_t> body;
  Header header{};
  while (synced_bytes_ < file_bytes) {
    if (!ReadFully(fd_, synced_bytes_, header.data(), header.size()) ||
        GetBigEndian(header.data(), 4) != kMagic) {
      break;
    }
    const auto name_bytes = static_cast<uint32_t>(GetBigEndian(header.data() + 20, 4));
    const auto data_bytes = static_cast<uint32_t>(GetBigEndian(header.data() + 24, 4));
    const int64_t body_offset = synced_bytes_ + static_cast<int64_t>(kHeaderBytes);
    const int64_t end = body_offset + name_bytes + data_bytes;
    if (name_bytes < 1 || name_bytes > kMaxChannelName || data_bytes > kMaxPayload ||
        end > file_bytes) {
      break;
    }
    body.resize(name_bytes + data_bytes);
    if (!ReadFully(fd_, body_offset, body.data(), body.size())) {
      break;
    }
    const std::string channel(body.begin(), body.begin() + name_bytes);
    const bool good = visitor(channel, Bytes(body).subspan(name_bytes),
                              {body_offset + name_bytes, static_cast<int32_t>(data_bytes)});
    // Pages of the last writes may have reached the disk in any order: damage there is a torn tail.
    if (!good && file_bytes - synced_bytes_ <= kMaxTornBytes) {
      break;
    }
    next_event_ = static_cast<int64_t>(GetBigEndian(header.data() + 4, 8)) + 1;
    synced_bytes_ = end;
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
  Header header{};
  PutBigEndian(kMagic, 4, header.data());
  PutBigEndian(static_cast<uint64_t>(next_event_++), 8, header.data() + 4);
  PutBigEndian(static_cast<uint64_t>(utime), 8, header.data() + 12);
  PutBigEndian(channel.size(), 4, header.data() + 20);
  PutBigEndian(data.size(), 4, header.data() + 24);
  queue_.insert(queue_.end(), header.begin(), header.end());
  queue_.insert(queue_.end(), channel.begin(), channel.end());
  const int64_t offset = synced_bytes_ + static_cast<int64_t>(queue_.size());
  queue_.insert(queue_.end(), data.begin(), data.end());
  return {offset, static_cast<int32_t>(data.size())};
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
