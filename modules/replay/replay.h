#pragma once

// Deterministic replay: the server's modules in one process, on one thread, over captured logs, in
// log order, each message handled to completion. Same binary, same logs: the same bytes.

#include <cstdint>
#include <filesystem>
#include <iterator>
#include <limits>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "files/progress.h"
#include "log_file/log_reading.h"
#include "server_options/server_options.h"

namespace pangea {

struct ReplaySummary {
  int64_t keyframes = 0;
  std::vector<int32_t> agent_ids;  // in order of appearance
};

// Replays the keyframes of `logs`, and writes them and all messages of the server to `out_log` (an
// LCM log like a session's). Several logs are interleaved by the time since each one's first
// keyframe, as if they had started together; the first log's map is the oldest. The server runs
// with `options`; they come first in `out_log` (OPTIONS_*), so that a replay of it uses them.
// `until_s`: only the keyframes of the first `until_s` seconds, since the log's first event, or,
// for several logs, since their first keyframes. Throws std::runtime_error for a log that cannot be
// read, has no keyframes, or has gaps (listed). Damaged parts of a log are reported in `readings`
// (log_reader.h), and the progress in `progress`, here and below.
ReplaySummary Replay(const std::vector<std::filesystem::path>& logs, const ServerOptions& options,
                     double until_s, const std::filesystem::path& out_log, Progress& progress,
                     LogReadings* readings = nullptr);

inline constexpr const char* kReplayed[] = {"place_recognition", "inter_map_ba", "fusion",
                                            "posegraph",         "global_ba",    "anchors"};

struct ReplayedPart {
  std::set<std::string> processes{std::begin(kReplayed), std::end(kReplayed)};
  // Up to this time, in seconds since the log's first event, matches and verification results are
  // taken from the log.
  std::optional<double> checkpoint_s;
  double until_s = std::numeric_limits<double>::infinity();
  ServerOptions options;
};

// Runs only some of these processes, or all of them from a checkpoint on. Their input comes from
// the log, in its order: keyframes, anchor edits, matches, verification results and states of the
// other processes, and, up to the checkpoint, all matches and verification results. Writes this
// input and the processes' own messages, at the points where they are sent now. The log of a replay
// gives the same messages again (place_recognition and fusion without inter_map_ba: perhaps in
// another order). In a live session, some messages depend on what arrived while a
// process was busy: matches and states may then differ without any error. Returns how many matches
// and verification results were taken from the log instead of being computed. Throws as Replay
// does.
int64_t ReplayPart(const std::filesystem::path& log, const ReplayedPart& part,
                   const std::filesystem::path& out_log, Progress& progress,
                   LogReadings* readings = nullptr);

}  // namespace pangea
