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

namespace pangea::session {

struct ReplaySummary {
  int64_t keyframes = 0;
  std::vector<int32_t> agent_ids;  // in order of appearance
};

// Reads the keyframes of `logs` and writes everything the server says about them, with them, to
// `out_log` (an LCM log like a session's). Several logs are interleaved by the time since each
// one's first keyframe, as if they had started together; the first log's map is the oldest.
// They run with `options`, which the log says first (OPTIONS_*), so that a replay of it has them.
// `until_s`: only keyframes of so many seconds, since the log's first event, or since the first
// keyframes of several. Throws std::runtime_error for a log that cannot be read, has no keyframes,
// or has gaps (named). What of a log is lost is noted in `readings` (log_reader.h), and how far it
// is in `progress`, here and below.
ReplaySummary Replay(const std::vector<std::filesystem::path>& logs, const ServerOptions& options,
                     double until_s, const std::filesystem::path& out_log, Progress& progress,
                     LogReadings* readings = nullptr);

inline constexpr const char* kReplayed[] = {"place_recognition", "inter_map_ba", "fusion",
                                            "posegraph",         "global_ba",    "anchors"};

struct ReplayedPart {
  std::set<std::string> processes{std::begin(kReplayed), std::end(kReplayed)};
  // Up to here, seconds since the log's first event, matches and verification results are the
  // log's.
  std::optional<double> checkpoint_s;
  double until_s = std::numeric_limits<double>::infinity();
  ServerOptions options;
};

// Some of these processes alone, or all of them from a checkpoint on, fed with what was said in the
// log in its order by the others, and up to the checkpoint by those who match and verify:
// keyframes, anchor edits, matches, verification results, states. Writes that and their own
// messages, which stand in the log where they sent them now. A log of a replay gives the same
// messages again. In a live session some of them depend on what came while the process was busy:
// there, matches and states may differ for no fault of anyone's. Returns how many matches and
// verification results are the log's instead of their own. Throws as Replay does.
int64_t ReplayPart(const std::filesystem::path& log, const ReplayedPart& part,
                   const std::filesystem::path& out_log, Progress& progress,
                   LogReadings* readings = nullptr);

}  // namespace pangea::session
