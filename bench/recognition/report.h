#pragma once

// What pangea-recognition-bench writes: a table, the curves, and a row for every place looked at.

#include <filesystem>
#include <string>

#include "bench/recognition/stages.h"

namespace pangea::bench {

// Markdown.
std::string Table(const Outcome& outcome);
// own_map.png and other_maps.png: precision over recall, a dot where the system decides; no picture
// of a search that has nothing to find. Throws std::runtime_error when gnuplot fails.
void WriteCurves(const Outcome& outcome, const std::filesystem::path& folder);
std::string Csv(const Outcome& outcome);

}  // namespace pangea::bench
