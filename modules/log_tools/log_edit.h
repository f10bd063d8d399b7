#pragma once

// Lists, cuts and merges LCM logs. The results are ordinary logs; events keep their capture time.
// From a damaged log the readable parts are used, so the new log is undamaged. Damaged parts are
// reported in `readings` (log_reader.h).

#include <cstdint>
#include <limits>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "log_file/log_reading.h"
#include "log_file/log_writer.h"

namespace pangea {

struct LogCut {
  double from_s = 0;  // since the log's first event, capture time
  double to_s = std::numeric_limits<double>::infinity();
  std::string channels = ".*";  // regular expression for the whole name
};

enum class ListAs : uint8_t {
  kLines,   // time (seconds since the log's first event), channel, type, bytes
  kFields,  // also each field of the message; of arrays the first eight items
  kJson,    // one object: utime (capture time), channel, type, message
};

// Lists the events of a cut, one per line. Throws std::runtime_error if the cut has no event.
void ListEvents(const std::string& log, const LogCut& cut, ListAs as, std::ostream& out,
                LogReadings* readings = nullptr);

// A new log, under a temporary name until Keep: a part of a log must not pass for the whole.
// Without Keep it is removed.
class NewLog {
 public:
  // Throws std::runtime_error if the file exists: nothing is overwritten.
  explicit NewLog(const std::string& path);
  ~NewLog();
  NewLog(const NewLog&) = delete;
  NewLog& operator=(const NewLog&) = delete;

  // The file is made when it is first written to. Throws std::runtime_error.
  void Write(int64_t utime, const std::string& channel, Bytes data);
  // At least one event must have been written.
  void Keep();
  int64_t count() const { return count_; }

 private:
  const std::string path_;
  const std::string made_;  // the temporary name
  std::optional<LogFileWriter> writer_;
  int64_t count_ = 0;
};

// Both return the number of events written. They throw std::runtime_error if a log cannot be read,
// the output exists or cannot be written, the regular expression is invalid, or the cut has no
// event.
int64_t CutLog(const std::string& log, const LogCut& cut, const std::string& out,
               LogReadings* readings = nullptr);
// Writes all events of the logs in order of capture time; at equal times, in the order of the logs.
int64_t MergeLogs(const std::vector<std::string>& logs, const std::string& out,
                  LogReadings* readings = nullptr);

}  // namespace pangea
