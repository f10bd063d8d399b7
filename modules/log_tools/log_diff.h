#pragma once

// Where two runs part: the first message of each channel that is not the same in two logs, and the
// first field of it that is not.

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "log_file/log_reading.h"

namespace pangea::session {

struct ChannelDiff {
  std::string channel;
  int64_t count_a = 0, count_b = 0;
  // The first message that differs, counted from 0 on this channel; none: all are the same.
  std::optional<int64_t> first;
  double seconds = 0;  // when it was captured, since its log's first event: a's, or where a has no
                       // more, b's
  std::string how;     // "candidates[0].score: 0.41 | 0.4, and 3 more fields"
};

struct LogDiff {
  std::vector<ChannelDiff> channels;  // by name

  // Of the channels that differ, the one that does so first, if possible one that is in both logs;
  // null when none does.
  const ChannelDiff* First() const;
};

// The n-th message of a channel is compared with the n-th of the other's, field by field but for
// revisions, which each run counts in its own way; capture times are not compared. STATUS_*, HAVE,
// RESEND_REQUEST, VERDICT_REQUEST and AGAIN_*, which tell of the run and not of its outcome, are
// left out. Of both logs the first `until_s` seconds. Throws std::runtime_error for a log that
// cannot be read; what of one is lost is noted in `readings` (log_reader.h).
LogDiff DiffLogs(const std::string& a, const std::string& b,
                 double until_s = std::numeric_limits<double>::infinity(),
                 LogReadings* readings = nullptr);

std::string ToText(const LogDiff& diff);

}  // namespace pangea::session
