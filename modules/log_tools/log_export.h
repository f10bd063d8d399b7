#pragma once

// What a server bus' log amounts to, in other tools' formats. What of the log is lost is noted in
// `readings` (log_reader.h).

#include <string>
#include <vector>

#include "core/ids.h"
#include "log_file/log_reading.h"
#include "log_tools/g2o.h"

namespace pangea::session {

// Where each agent's keyframes are, in its group's map frame: <folder>/agent_<id>.tum, one file
// more for each further map. Returns the files.
std::vector<std::string> ExportTum(const std::string& log, const std::string& folder,
                                   LogReadings* readings = nullptr);
// Map points of the largest group, coloured by agent.
void ExportPly(const std::string& log, const std::string& file, LogReadings* readings = nullptr);

// The keyframes of all groups as the log has them last, their odometry edges, and the accepted
// constraints, those too that a robust solve would switch off. Vertices are numbered from 0 by
// group, map and seq; `keyframes` tells which keyframe each one is.
struct NamedGraph {
  Graph graph;
  std::vector<KeyframeId> keyframes;
};
NamedGraph GraphOf(const std::string& log, LogReadings* readings = nullptr);

}  // namespace pangea::session
