#include "files/disk_io.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>

namespace pangea {
namespace {

// `operation`: pread or pwrite.
template <typename Operation, typename Byte>
bool Transfer(Operation operation, int fd, int64_t offset, Byte* bytes, size_t size) {
  while (size > 0) {
    const ssize_t count = operation(fd, bytes, size, offset);
    if (count < 0 && errno == EINTR) {
      continue;
    }
    if (count <= 0) {
      errno = count == 0 ? 0 : errno;
      return false;
    }
    bytes += count;
    offset += count;
    size -= static_cast<size_t>(count);
  }
  return true;
}

}  // namespace

bool ReadFully(int fd, int64_t offset, void* out, size_t size) {
  return Transfer(pread, fd, offset, static_cast<uint8_t*>(out), size);
}

bool WriteFully(int fd, int64_t offset, const void* data, size_t size) {
  return Transfer(pwrite, fd, offset, static_cast<const uint8_t*>(data), size);
}

bool TrySyncToDisk(const std::filesystem::path& path) {
  const int fd = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) {
    return false;
  }
  const bool synced = fsync(fd) == 0;
  const int error = errno;
  close(fd);
  errno = error;
  return synced;
}

void SyncToDisk(const std::filesystem::path& path) {
  if (!TrySyncToDisk(path)) {
    throw std::runtime_error(
        fmt::format("{}: cannot be brought to the disk: {}", path.string(), std::strerror(errno)));
  }
}

}  // namespace pangea
