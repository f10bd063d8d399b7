#pragma once

// Imports the solution of another solver into a log.

#include <cstdint>
#include <string>

#include "log_file/log_reading.h"
#include "log_tools/solved_graph.h"

namespace pangea {

// Copies `log` to `out`, and appends, as the newest MAP_STATE of each group, the poses of a g2o
// file that was exported from the log (with the vertex numbers of GraphOf) and solved elsewhere. A
// report or a viewer of `out` shows that solution. The file's edges are not used. Throws
// std::runtime_error, and writes nothing, if the file's vertices are not the log's keyframes, if
// its poses are no solution of the log's graph (solved_graph.h), or if a pose is invalid in a
// message. Damaged parts of the log are reported in `readings` (log_reader.h); the new log is
// undamaged.
struct ImportedG2o {
  int64_t keyframes = 0;  // with a new pose
  SolvedPoses poses;
};
ImportedG2o ImportG2o(const std::string& log, const std::string& g2o, const std::string& out,
                      LogReadings* readings = nullptr);

}  // namespace pangea
