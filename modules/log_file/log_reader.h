#pragma once

// LCM log files, event by event; behind damage it goes on with the next whole event. CHECKSUMS,
// where a log has them, are verified, and an event that they contradict is damage too.

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "bus/bus.h"
#include "log_file/checked_scan.h"
#include "log_file/log_reading.h"

namespace pangea {

struct LogEvent {
  int64_t utime = 0;  // when the event was captured, wall clock, microseconds
  std::string channel;
  Bytes data;          // valid during the call
  int64_t number = 0;  // as the log counts
};

// One thread.
class LogReader {
 public:
  // Throws std::runtime_error when the file cannot be opened.
  explicit LogReader(const std::string& path);
  LogReader(const LogReader&) = delete;
  LogReader& operator=(const LogReader&) = delete;
  ~LogReader();

  // In file order, without CHECKSUMS and DAMAGED; null at the end. Valid until the next call.
  // Throws std::runtime_error when the file cannot be read, and at its end when it is no LCM log.
  const LogEvent* Next();
  // Of what was read so far.
  const LogReading& reading() const { return reading_; }
  // How far it is: the end of the last event, and the file's.
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
  int64_t lost_end_ = -1;   // of the last place
  bool lost_open_ = false;  // what comes behind it is not yet known
};

// Whether how far it is stands on stderr (files/progress.h). Not where the handler prints: on a
// terminal the two would be one line.
enum class WhileReading : uint8_t { kTellProgress, kTellNothing };

// All of the log. What could not be read of it is noted in `readings`; without them a log that is
// not whole throws std::runtime_error too, when the handler has had what there is.
void ReadLog(const std::string& path, const std::function<void(const LogEvent&)>& handler,
             LogReadings* readings = nullptr,
             WhileReading while_reading = WhileReading::kTellProgress);

}  // namespace pangea
