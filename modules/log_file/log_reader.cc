#include "log_file/log_reader.h"

#include <fmt/format.h>

#include <filesystem>
#include <lcm/lcm-cpp.hpp>
#include <stdexcept>

namespace pangea {

void ReadLog(const std::string& path, const std::function<void(const LogEvent&)>& handler) {
  if (!std::filesystem::is_regular_file(path)) {
    throw std::runtime_error(fmt::format("{}: there is no such log", path));
  }
  lcm::LogFile log(path, "r");
  if (!log.good()) {
    throw std::runtime_error(fmt::format("{}: cannot be opened as an LCM log", path));
  }
  while (const lcm::LogEvent* event = log.readNextEvent()) {
    handler({event->timestamp, event->channel,
             Bytes(static_cast<const uint8_t*>(event->data), static_cast<size_t>(event->datalen))});
  }
}

}  // namespace pangea
