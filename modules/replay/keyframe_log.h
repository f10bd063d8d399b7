#pragma once

// Reads the keyframes of captured LCM logs, to feed them to the server again.

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/ids.h"
#include "log_file/log_reading.h"

namespace pangea {

struct LoggedKeyframe {
  std::string channel;
  KeyframeId id;
  int64_t utime = 0;           // sensor clock
  std::vector<uint8_t> data;   // the encoded keyframe_t
  int64_t captured_utime = 0;  // wall clock; does not decrease from one to the next
  int64_t elapsed_us = 0;      // capture time since the log's first event
};

// All distinct keyframes of one log, in log order. Throws std::runtime_error that names the log if
// it cannot be read, a keyframe does not decode, it has no keyframe, or a map's keyframes are out
// of order or have gaps without an odometry edge across them (the message lists them); a keyframe
// whose values the server refuses is such a gap. Damaged parts of the log are reported in
// `readings` (log_reader.h).
std::vector<LoggedKeyframe> ReadKeyframeLog(const std::filesystem::path& log,
                                            LogReadings* readings = nullptr);

// Only the keyframes of one agent. Throws std::runtime_error that names the log if it has none.
std::vector<LoggedKeyframe> ReadKeyframeLogOf(const std::filesystem::path& log, int32_t agent_id,
                                              LogReadings* readings = nullptr);

// Merges several logs as if they had started together: ordered by the time since each log's first
// keyframe, ties by the order of the logs; each log keeps its own order. The clock of this time is
// the sensor's, and the capture's up to the first keyframe of each map: the agents of a log have
// different sensor clocks. elapsed_us becomes that time; a single log is unchanged.
std::vector<LoggedKeyframe> Interleave(std::vector<std::vector<LoggedKeyframe>> logs);

}  // namespace pangea
