#pragma once

// Summarises an LCM log: channels, and the maps with their missing keyframes.

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "core/ids.h"
#include "log_file/log_reading.h"

namespace pangea {

struct ChannelSummary {
  int64_t events = 0;
  int64_t bytes = 0;
  int64_t first_utime = 0, last_utime = 0;  // capture time
};

struct LogSummary {
  LogReading reading;
  int64_t events = 0;
  int64_t bytes = 0;                        // of the events read
  int64_t first_utime = 0, last_utime = 0;  // capture time
  std::map<std::string, ChannelSummary> channels;
  std::map<MapId, std::set<int32_t>> keyframes;  // seqs by map
  std::map<std::string, int64_t> results;        // constraints by reason of refusal, or "accepted"
};

// Summarises the readable parts. Throws std::runtime_error if the file cannot be opened or is not a
// log.
LogSummary Summarise(const std::string& log);
// The agents whose odometry's channels are in the logs; an odometry that never started has no
// keyframes.
std::set<int32_t> AgentsIn(const std::vector<std::string>& logs, LogReadings* readings = nullptr);
// A text for people.
std::string ToText(const LogSummary& summary, const std::string& log);

}  // namespace pangea
