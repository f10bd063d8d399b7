#pragma once

// Exports the result in a server bus' log in formats of other tools. Damaged parts of the log are
// reported in `readings` (log_reader.h).

#include <string>
#include <vector>

#include "core/ids.h"
#include "g2o/g2o.h"
#include "log_file/log_reading.h"

namespace pangea {

// Writes the poses of each agent's keyframes in its group's map frame: <folder>/agent_<id>.tum, and
// another file for each further group of the agent, and for each map of another recording
// (recording_maps.h). Returns the files. Throws std::runtime_error if
// there are none.
std::vector<std::string> ExportTum(const std::string& log, const std::string& folder,
                                   LogReadings* readings = nullptr);
// Why the exports lack the fusions, if they do; else empty.
std::string RemarkOnExport(const std::string& log, LogReadings* readings = nullptr);
// Writes the map points of the largest group, coloured by agent.
void ExportPly(const std::string& log, const std::string& file, LogReadings* readings = nullptr);

// The pose graph at the end of the log: keyframes of all groups, odometry edges, and all accepted
// constraints, including those that a robust solve would switch off. Vertices are numbered from 0
// by group, map and seq; `keyframes` has the keyframe of each vertex.
struct NamedGraph {
  Graph graph;
  std::vector<KeyframeId> keyframes;
};
NamedGraph GraphOf(const std::string& log, LogReadings* readings = nullptr);

}  // namespace pangea
