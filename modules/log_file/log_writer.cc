#include "log_file/log_writer.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>

#include "log_file/log_event.h"

namespace pangea {

LogFileWriter::LogFileWriter(const std::string& path) : path_(path), file_(path, std::ios::binary) {
  if (!file_) {
    throw std::runtime_error(fmt::format("{}: cannot be written: {}", path, std::strerror(errno)));
  }
}

void LogFileWriter::Write(int64_t utime, const std::string& channel, Bytes data) {
  event_.clear();
  AppendLogEvent(count_++, utime, channel, data, &event_);
  file_.write(reinterpret_cast<const char*>(event_.data()), static_cast<int64_t>(event_.size()));
  file_.flush();  // or the destructor would write the rest, and could not tell of a full disk
  if (!file_) {
    throw std::runtime_error(fmt::format("{}: cannot be written (disk full?)", path_));
  }
}

}  // namespace pangea
