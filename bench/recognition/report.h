#pragma once

// Output of pangea-recognition-bench: a table, the curves, and one row for every place that was
// checked.

#include <filesystem>
#include <string>

#include "bench/recognition/stages.h"

namespace pangea::bench {

// Markdown.
std::string Table(const Outcome& outcome);
// Writes own_map.png and other_maps.png: precision over recall, with a dot for the system's own
// decision; no picture for a search without any place to be recognised. Throws std::runtime_error
// if gnuplot fails.
void WriteCurves(const Outcome& outcome, const std::filesystem::path& folder);
std::string Csv(const Outcome& outcome);

}  // namespace pangea::bench
