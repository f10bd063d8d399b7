#pragma once

// The outcome of a session: which maps are one, and where each keyframe lies in its group's frame.

#include <vector>

#include "report/report_log.h"

namespace pangea::session {

struct FinalKeyframe {
  KeyframeId id;
  int64_t utime = 0;
  Rigid3 T_map_body;
};

struct FinalGroup {
  MapId frame;                           // the map whose odom frame is the map frame
  std::vector<MapId> maps;               // ascending
  std::vector<FinalKeyframe> keyframes;  // ascending by id
  int num_switched_off = 0;              // constraints the robust solve switched off

  std::vector<int32_t> Agents() const;     // ascending, each once
  size_t CountOf(int32_t agent_id) const;  // keyframes of that agent
  // Of one agent's keyframes, or of one of its maps.
  Trajectory TrajectoryOf(int32_t agent_id) const;
  Trajectory TrajectoryOf(const MapId& map) const;
};

// Each map belongs to the newest state that mentions it. Keyframes that state does not hold move
// with the solved one before them (the odometry carried on); a map no state mentions is a group
// of its own, its poses the odometry's. Most agents first, then most keyframes.
std::vector<FinalGroup> FinalGroups(const CapturedSession& session);

}  // namespace pangea::session
