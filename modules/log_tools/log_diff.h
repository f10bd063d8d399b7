#pragma once

// Finds where two runs begin to differ: the first different message of each channel in two logs,
// and its first different field.

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "log_file/log_reading.h"

namespace pangea {

struct ChannelDiff {
  std::string channel;
  int64_t count_a = 0, count_b = 0;
  // The first message that differs, counted from 0 on this channel; empty: all are equal.
  std::optional<int64_t> first;
  // Capture time of that message, since its log's first event: in a, or in b if a has no more
  double seconds = 0;
  std::string how;  // "candidates[0].score: 0.41 | 0.4, and 3 more fields"
};

struct LogDiff {
  std::vector<ChannelDiff> channels;  // by name

  // The channel that differs first, if possible one that is in both logs; null if none differs.
  const ChannelDiff* First() const;
};

// Compares the n-th message of each channel in a with the n-th in b, field by field, except
// revisions, which each run counts differently; capture times are not compared. STATUS_*, HAVE,
// RESEND_REQUEST, VERDICT_REQUEST and AGAIN_* are left out: they describe the run, not its result.
// Compares the first `until_s` seconds of both logs. Throws std::runtime_error for a log that
// cannot be read; damaged parts are reported in `readings` (log_reader.h).
LogDiff DiffLogs(const std::string& a, const std::string& b,
                 double until_s = std::numeric_limits<double>::infinity(),
                 LogReadings* readings = nullptr);

std::string ToText(const LogDiff& diff);

}  // namespace pangea
