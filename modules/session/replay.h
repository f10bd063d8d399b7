#pragma once

// Deterministic replay: the server's modules in one process, on one thread, over the KEYFRAME_* of
// captured logs, in log order, each handled to completion. Same binary, same logs: the same bytes.

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace pangea::session {

struct ReplaySummary {
  int64_t keyframes = 0;
  std::vector<int32_t> agent_ids;  // in order of appearance
};

// Reads the keyframes of `logs` and writes everything the server says about them, with them, to
// `out_log` (an LCM log like a session's). Several logs are interleaved by the time since each
// one's first keyframe, as if they had started together; the first log's map is the oldest. Throws
// std::runtime_error for a log that cannot be read, has no keyframes, or has gaps (named).
ReplaySummary Replay(const std::vector<std::filesystem::path>& logs,
                     const std::filesystem::path& out_log);

}  // namespace pangea::session
