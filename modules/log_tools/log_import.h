#pragma once

// Another solver's answer brought back into a log.

#include <cstdint>
#include <string>

#include "log_file/log_reading.h"

namespace pangea::session {

// Writes `log` again to `out`, and at its end, as the newest MAP_STATE of each group, the poses of
// a g2o file that was exported from it (vertices as GraphOf numbers them) and solved elsewhere. A
// report or a viewer of `out` shows that solution. Of the file's edges nothing is taken. Returns
// how many keyframes it placed. Throws std::runtime_error, and writes nothing, when the file's
// vertices are not the log's keyframes or a pose is one that no message may carry. What of the log
// is lost is noted in `readings` (log_reader.h); the new one is whole.
int64_t ImportG2o(const std::string& log, const std::string& g2o, const std::string& out,
                  LogReadings* readings = nullptr);

}  // namespace pangea::session
