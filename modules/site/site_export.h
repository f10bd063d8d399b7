#pragma once

// Exports a site's maps in formats of other programs.

#include <filesystem>
#include <string>
#include <vector>

#include "log_file/log_reading.h"
#include "site/site.h"

namespace pangea::site {

// Runs the deterministic replay of the journal, with the options in the journal, and writes to a
// new folder: agent_<id>.tum (other groups: agent_<id>.<map>.tum), map.ply of the largest group; if
// there are anchors, also anchors.json and map.gltf, with the anchors and the points of all groups.
// Returns the files. A server may run; what it writes meanwhile is left out. Throws
// std::runtime_error if there are no keyframes, keyframes are missing, or `out` is not empty; what
// an export that was killed left there is removed.
std::vector<std::string> ExportSite(const Site& site, const std::filesystem::path& out,
                                    LogReadings* readings);

}  // namespace pangea::site
