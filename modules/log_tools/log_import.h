#pragma once

// Another solver's answer brought back into a log.

#include <cstdint>
#include <string>

namespace pangea::session {

// Writes `log` again to `out`, and at its end, as the newest MAP_STATE of each group, the poses of
// a g2o file that was exported from it (vertices as GraphOf numbers them) and solved elsewhere. A
// report or a viewer of `out` shows that solution. Returns how many keyframes it placed. Throws
// std::runtime_error when the file's vertices are not the log's keyframes.
int64_t ImportG2o(const std::string& log, const std::string& g2o, const std::string& out);

}  // namespace pangea::session
