#pragma once

// Reads LCM log files event by event. After damage it continues with the next whole event. If a log
// has CHECKSUMS, they are verified, and an event that they contradict counts as damage.

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "core/bytes.h"
#include "log_file/checked_scan.h"
#include "log_file/log_reading.h"

namespace pangea {

struct LogEvent {
  int64_t utime = 0;  // when the event was captured, wall clock, microseconds
  std::string channel;
  Bytes data;          // valid until the next event is read
  int64_t number = 0;  // the event number in the log
};

// Not thread safe.
class LogReader {
 public:
  // Throws std::runtime_error when the file cannot be opened.
  explicit LogReader(const std::string& path);
  LogReader(const LogReader&) = delete;
  LogReader& operator=(const LogReader&) = delete;
  ~LogReader();

  // The next event in the file, without CHECKSUMS and DAMAGED; null at the end. Valid until the
  // next call. Throws std::runtime_error when the file cannot be read, and at its end when the file
  // is not an LCM log.
  const LogEvent* Next();
  // What was read and lost so far.
  const LogReading& reading() const { return reading_; }
  // Progress: the end of the last piece read, and the size of the file, bytes.
  int64_t read_bytes() const { return read_bytes_; }
  int64_t file_bytes() const { return scan_.file_bytes(); }

 private:
  const LogPiece* NextPiece();
  bool Take(const LogPiece& piece);
  void Lose(const LogPiece& piece);
  void See(const LogPiece& event);
  void CheckIsLog() const;

  const std::string path_;
  const int fd_;
  CheckedScan scan_;
  LogReading reading_;
  LogEvent event_;
  int64_t read_bytes_ = 0;
  std::optional<int64_t> first_utime_;
  std::optional<LostPlace::Event> last_;
  int64_t lost_end_ = -1;   // end of the last lost place
  bool lost_open_ = false;  // the event after the last lost place is not yet known
};

// Whether progress is shown on stderr (files/progress.h). Use kTellNothing if the handler prints,
// because on a terminal both would be on one line.
enum class WhileReading : uint8_t { kTellProgress, kTellNothing };

// Gives all events of the log to the handler. `readings` gets what could not be read. If `readings`
// is null, a log with losses throws std::runtime_error after its last event. Throws as LogReader.
void ReadLog(const std::string& path, const std::function<void(const LogEvent&)>& handler,
             LogReadings* readings = nullptr,
             WhileReading while_reading = WhileReading::kTellProgress);

}  // namespace pangea
