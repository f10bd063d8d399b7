#pragma once

// LCM logs listed, cut and put together. The logs made are ordinary ones; events keep their capture
// time. Of a damaged log what can be read is taken: the new one is whole. What was lost is noted in
// `readings` (log_reader.h).

#include <cstdint>
#include <limits>
#include <ostream>
#include <string>
#include <vector>

#include "log_file/log_reading.h"

namespace pangea::session {

struct LogCut {
  double from_s = 0;  // since the log's first event, capture time
  double to_s = std::numeric_limits<double>::infinity();
  std::string channels = ".*";  // regular expression for the whole name
};

enum class ListAs : uint8_t {
  kLines,   // when, seconds since the log's first event; channel, type, bytes
  kFields,  // and below it each field of the message, of arrays the first eight items
  kJson,    // one object: utime (of capture), channel, type, message
};

// The events of a cut, one a line. Throws std::runtime_error for a cut without an event.
void ListEvents(const std::string& log, const LogCut& cut, ListAs as, std::ostream& out,
                LogReadings* readings = nullptr);

// Throws std::runtime_error when the file exists: nothing is overwritten.
void CheckNew(const std::string& path);

// Both return how many events they wrote, and throw std::runtime_error for a log that cannot be
// read, an output that exists or cannot be written, an expression that is none, and a cut without
// an event.
int64_t CutLog(const std::string& log, const LogCut& cut, const std::string& out,
               LogReadings* readings = nullptr);
// All events of the logs in the order of capture; of equal times the earlier log's first.
int64_t MergeLogs(const std::vector<std::string>& logs, const std::string& out,
                  LogReadings* readings = nullptr);

}  // namespace pangea::session
