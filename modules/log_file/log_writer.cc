#include "log_file/log_writer.h"

#include <fmt/format.h>

#include <stdexcept>

namespace pangea {

LogFileWriter::LogFileWriter(const std::string& path) : path_(path), file_(path, "w") {
  if (!file_.good()) {
    throw std::runtime_error(fmt::format("{}: cannot be written", path));
  }
}

void LogFileWriter::Write(int64_t utime, const std::string& channel, Bytes data) {
  lcm::LogEvent event;
  event.eventnum = count_++;
  event.timestamp = utime;
  event.channel = channel;
  event.datalen = static_cast<int32_t>(data.size());
  event.data = const_cast<uint8_t*>(data.data());  // it is only read
  if (file_.writeEvent(&event) != 0) {
    throw std::runtime_error(fmt::format("{}: cannot be written (disk full?)", path_));
  }
}

}  // namespace pangea
