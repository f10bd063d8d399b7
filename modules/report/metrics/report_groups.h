#pragma once

// The result of a session: the groups of maps, and the pose of each keyframe in its group's frame.

#include <set>
#include <vector>

#include "report/report_log.h"

namespace pangea {

struct FinalKeyframe {
  KeyframeId id;
  int64_t utime = 0;
  Rigid3 T_map_body;
};

struct FinalGroup {
  MapId frame;                           // the map whose odom frame is the map frame
  std::vector<MapId> maps;               // ascending
  std::vector<FinalKeyframe> keyframes;  // ascending by id
  int num_switched_off = 0;              // constraints that the robust solve switched off

  std::vector<int32_t> Agents() const;  // ascending, each once
  // Number of keyframes of an agent, or of these maps.
  size_t CountOf(int32_t agent_id) const;
  size_t CountOf(const std::set<MapId>& maps) const;
  // The trajectory of these maps' keyframes. They must be of one recording: the clocks of two may
  // overlap.
  Trajectory TrajectoryOf(const std::set<MapId>& maps) const;
};

// Each map belongs to the newest state that mentions it. Keyframes missing in that state are placed
// by odometry from the solved keyframe before them. A map that no state mentions is a group of its
// own, with the odometry's poses. Groups are sorted by number of agents, then of keyframes, the
// largest first.
std::vector<FinalGroup> FinalGroups(const CapturedSession& session);

// Whether the log has accepted constraints, but no state that they led to, as a journal:
// FinalGroups then knows nothing of the fusions.
bool LacksStates(const CapturedSession& session);
inline constexpr const char* kLacksStates =
    "no MAP_STATE in this log: each map stands alone, with its odometry's poses. The log of "
    "pangea-session replay has the fused maps";

}  // namespace pangea
