#pragma once

// What a site's map amounts to, in formats that other programs read.

#include <filesystem>
#include <string>
#include <vector>

#include "log_file/log_reading.h"
#include "site/site.h"

namespace pangea::site {

// Runs the deterministic replay of the journal, with the options that the journal has, into a new
// folder: agent_<id>.tum (further groups: agent_<id>.<map>.tum), map.ply of the largest group; and
// if there are anchors, anchors.json and map.gltf, which has them among the points of all groups.
// Returns the files. A server may run: what it writes meanwhile is left out. Throws
// std::runtime_error: no keyframes, keyframes are missing, `out` is not empty.
std::vector<std::string> ExportSite(const Site& site, const std::filesystem::path& out,
                                    LogReadings* readings);

}  // namespace pangea::site
