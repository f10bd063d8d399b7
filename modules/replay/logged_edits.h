#pragma once

// Reads the anchor edits of captured LCM logs, to feed them to the server again.

#include <filesystem>
#include <map>
#include <vector>

#include "core/ids.h"
#include "log_file/log_reading.h"
#include "pangea/anchor_edit_t.hpp"

namespace pangea {

// Keyed by the keyframe that precedes the edits in the log; edits before the first keyframe have
// that one's key. The server's log and a journal contain edits; an agent's log does not.
using LoggedEdits = std::map<KeyframeId, std::vector<anchor_edit_t>>;

// Each edit once. Throws std::runtime_error that names the log if it cannot be read. Damaged parts
// of the log are reported in `readings` (log_reader.h).
LoggedEdits ReadAnchorEdits(const std::filesystem::path& log, LogReadings* readings = nullptr);

// Adds `edits` to `all`, for several logs.
void Merge(const LoggedEdits& edits, LoggedEdits* all);

}  // namespace pangea
