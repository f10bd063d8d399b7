#pragma once

// Writes a new LCM log event by event.

#include <cstdint>
#include <fstream>
#include <string>
#include <vector>

#include "core/bytes.h"

namespace pangea {

class LogFileWriter {
 public:
  // Overwrites an existing file. Throws std::runtime_error when the file cannot be written.
  explicit LogFileWriter(const std::string& path);

  // Throws std::runtime_error as well. `utime`: wall clock, microseconds.
  void Write(int64_t utime, const std::string& channel, Bytes data);
  int64_t count() const { return count_; }

 private:
  const std::string path_;
  std::ofstream file_;
  std::vector<uint8_t> event_;
  int64_t count_ = 0;
};

}  // namespace pangea
