#pragma once

// A new LCM log, event by event.

#include <cstdint>
#include <lcm/lcm-cpp.hpp>
#include <optional>
#include <string>

#include "common/bus/bus.h"

namespace pangea::session {

class LogFileWriter {
 public:
  // Throws std::runtime_error when the file exists or cannot be written.
  explicit LogFileWriter(const std::string& path);

  void Write(int64_t utime, const std::string& channel, Bytes data);
  int64_t count() const { return count_; }

 private:
  std::string path_;
  std::optional<lcm::LogFile> file_;
  int64_t count_ = 0;
};

}  // namespace pangea::session
