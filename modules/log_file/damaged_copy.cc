#include "log_file/damaged_copy.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <stdexcept>

#include "files/disk_io.h"
#include "log_file/log_event.h"

namespace pangea {
namespace {

constexpr int64_t kChunk = 1 << 20;

bool Copy(int from, const std::vector<FileRange>& parts, int to) {
  std::vector<uint8_t> chunk;
  int64_t at = 0;
  for (FileRange part : parts) {
    while (part.begin < part.end) {
      chunk.resize(static_cast<size_t>(std::min(kChunk, part.end - part.begin)));
      if (!ReadFully(from, part.begin, chunk.data(), chunk.size()) ||
          !WriteFully(to, at, chunk.data(), chunk.size())) {
        return false;
      }
      part.begin += static_cast<int64_t>(chunk.size());
      at += static_cast<int64_t>(chunk.size());
    }
  }
  return true;
}

}  // namespace

std::string DamagedName(const std::string& file) {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  std::array<char, sizeof("20261231T235959Z")> date{};
  std::strftime(date.data(), date.size(), "%Y%m%dT%H%M%SZ", &utc);
  const std::string first = fmt::format("{}.damaged-{}", file, date.data());
  std::string name = first;
  for (int i = 2; std::filesystem::exists(std::filesystem::symlink_status(name)); ++i) {
    name = fmt::format("{}-{}", first, i);
  }
  return name;
}

std::string KeepDamaged(const std::string& file, int fd, const std::vector<FileRange>& parts) {
  std::string name = DamagedName(file);
  const int to = open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
  const bool copied = to >= 0 && Copy(fd, parts, to) && fsync(to) == 0 &&
                      TrySyncToDisk(std::filesystem::absolute(name).parent_path());
  const int error = errno;
  if (to >= 0) {
    close(to);
  }
  if (!copied) {
    if (to >= 0) {
      unlink(name.c_str());
    }
    throw std::runtime_error(
        fmt::format("'{}' is damaged, and is left as it is, for its damaged parts cannot be kept "
                    "in '{}': {}; make room there, or move it away",
                    file, name, std::strerror(error)));
  }
  return name;
}

}  // namespace pangea
