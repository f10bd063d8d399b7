#pragma once

// The keyframes of captured LCM logs, ready to be fed to the server again.

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/ids.h"
#include "log_file/log_reading.h"

namespace pangea::session {

struct LoggedKeyframe {
  std::string channel;
  KeyframeId id;
  int64_t utime = 0;           // sensor clock
  std::vector<uint8_t> data;   // the encoded keyframe_t
  int64_t captured_utime = 0;  // wall clock; never steps back from one to the next
  int64_t elapsed_us = 0;      // of the capture, since the log's first event
};

// All distinct keyframes of one log in log order. Throws std::runtime_error naming the log when it
// cannot be read, a keyframe does not decode, there is none, or a map's keyframes are out of order
// or have gaps that no odometry edge leads over (named). What of the log is lost is noted in
// `readings` (log_reader.h).
std::vector<LoggedKeyframe> ReadKeyframeLog(const std::filesystem::path& log,
                                            LogReadings* readings = nullptr);

// Those of one agent. Throws std::runtime_error naming the log when it has none.
std::vector<LoggedKeyframe> ReadKeyframeLogOf(const std::filesystem::path& log, int32_t agent_id,
                                              LogReadings* readings = nullptr);

// Several logs as if they had started together: ordered by the time since each log's first
// keyframe, ties by the order of the logs; each log keeps its own order. That time, by the sensor
// clock, is then the elapsed one; a single log is left as it is.
std::vector<LoggedKeyframe> Interleave(std::vector<std::vector<LoggedKeyframe>> logs);

}  // namespace pangea::session
