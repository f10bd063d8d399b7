#pragma once

// Checks the poses that another solver gave a log's pose graph, and brings them back into the log's
// map frames.
//
// A pose graph determines its poses only up to a rigid transform. A map frame is the odometry's, of
// which z is up, but other solvers choose their own: SE-Sync, for instance, puts the first vertex
// at the identity. So if a group's fixed vertex has moved, the whole group is moved back. Roll,
// pitch and scale are observable for the odometry: another solution may change them little.

#include <cstdint>
#include <string>
#include <vector>

#include "core/ids.h"
#include "g2o/graph.h"
#include "report/metrics/report_groups.h"

namespace pangea {

// Beyond these a solution contradicts the odometry.
inline constexpr double kMaxScaleChange = 0.05;
inline constexpr double kMaxTilt_deg = 10;
// The cost of a solution, relative to the log's, or to one sigma in each dimension of each edge.
inline constexpr double kMaxCostFactor = 100;

struct SolvedPoses {
  std::vector<std::string> remarks;  // what was done to the poses, for people
  double cost_before = 0;            // of the log's edges, at the log's poses
  double cost_after = 0;             // at the new ones
};

// Moves each group of `solved` back to its fixed vertex: the first one of the group with FIX in the
// file, else in the log. `log`: the exported graph, whose vertices are numbered by `groups`; both
// graphs have the same vertices. Throws std::runtime_error, with the factor or the angle, and what
// to do, if scale, roll and pitch, or the cost of the log's edges is not that of a solution of the
// log's graph. `file`: for messages.
SolvedPoses PlaceInMapFrames(const Graph& log, const std::vector<FinalGroup>& groups,
                             const std::string& file, Graph* solved);

}  // namespace pangea
