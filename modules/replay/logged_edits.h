#pragma once

// The anchor edits of captured LCM logs, ready to be fed to the server again.

#include <filesystem>
#include <map>
#include <vector>

#include "core/ids.h"
#include "log_file/log_reading.h"
#include "pangea/anchor_edit_t.hpp"

namespace pangea::session {

// By the keyframe that came before them; those that came before any, by the first one. The server's
// log or a journal has them; an agent's has none.
using LoggedEdits = std::map<KeyframeId, std::vector<anchor_edit_t>>;

// Each once. Throws std::runtime_error naming the log when it cannot be read. What of the log is
// lost is noted in `readings` (log_reader.h).
LoggedEdits ReadAnchorEdits(const std::filesystem::path& log, LogReadings* readings = nullptr);

// Edits of several logs.
void Merge(const LoggedEdits& edits, LoggedEdits* all);

}  // namespace pangea::session
