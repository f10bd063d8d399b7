#pragma once

// Several runs side by side, from their report.json: for choosing options.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace pangea::session {

// How long a run took, for CompareRuns; a report says nothing of it, as it is the same each time.
void WriteTiming(double wall_s, const std::filesystem::path& folder);

// A table with a row for each: constraints, their error where there is ground truth, ATE, groups,
// time; below it the options that are not the defaults. `runs`: folders of `run`, `replay` or
// `report`, or the report.json in them. Throws std::runtime_error about one that has no report.
std::string CompareRuns(const std::vector<std::filesystem::path>& runs);

}  // namespace pangea::session
