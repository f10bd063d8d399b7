#pragma once

// Compares several runs by their report.json, for choosing options.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace pangea {

// Writes how long a run took, for CompareRuns. It is not in the report, which must be reproducible.
void WriteTiming(double wall_s, const std::filesystem::path& folder);

// Returns a table with one row per run: constraints, their error if there is ground truth, ATE,
// groups, time; below it the options that are not the defaults. `runs`: output folders of `run`,
// `replay` or `report`, or the report.json in them. Throws std::runtime_error if one has no report.
std::string CompareRuns(const std::vector<std::filesystem::path>& runs);

}  // namespace pangea
