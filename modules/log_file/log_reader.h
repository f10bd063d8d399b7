#pragma once

// LCM log files, event by event.

#include <cstdint>
#include <functional>
#include <string>

#include "bus/bus.h"

namespace pangea {

struct LogEvent {
  int64_t utime = 0;  // when the event was captured, wall clock, microseconds
  std::string channel;
  Bytes data;  // valid during the call
};

// In file order. A log cut off in the middle of an event reads up to there. Throws
// std::runtime_error when the file cannot be opened.
void ReadLog(const std::string& path, const std::function<void(const LogEvent&)>& handler);

}  // namespace pangea
