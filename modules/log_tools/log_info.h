#pragma once

// What is in an LCM log: channels, and of keyframes the maps and what is missing of them.

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "core/ids.h"
#include "log_file/log_reading.h"

namespace pangea::session {

struct ChannelSummary {
  int64_t events = 0;
  int64_t bytes = 0;
  int64_t first_utime = 0, last_utime = 0;  // of capture
};

struct LogSummary {
  LogReading reading;
  int64_t events = 0;
  int64_t bytes = 0;                        // of the events read
  int64_t first_utime = 0, last_utime = 0;  // of capture
  std::map<std::string, ChannelSummary> channels;
  std::map<MapId, std::set<int32_t>> keyframes;  // seqs by map
  std::map<std::string, int64_t> results;        // constraints by reason; "accepted"
};

// Of what can be read of it. Throws std::runtime_error when the log cannot be opened, or is none.
LogSummary Summarise(const std::string& log);
// Whose odometry is in the logs, by its channels: one that never started made no keyframes.
std::set<int32_t> AgentsIn(const std::vector<std::string>& logs, LogReadings* readings = nullptr);
// For people.
std::string ToText(const LogSummary& summary, const std::string& log);

}  // namespace pangea::session
