#pragma once

// The files that an earlier report left in the folder of a new one.

#include <string>

namespace pangea {

// Removes the pictures, trajectories and maps of the report whose report.json is in the folder: of
// its agents and maps, the new report may lack some. Nothing else is removed, and nothing without a
// report.json that can be read.
void RemoveEarlierReport(const std::string& folder);

}  // namespace pangea
