#pragma once

// Names of the files in a report's folder (report.h).

#include <fmt/format.h>

#include <cstdint>
#include <optional>
#include <string>

#include "core/ids.h"

namespace pangea {

// ".1_1700000000000000"; nothing without a map.
inline std::string OfMap(const std::optional<MapId>& map) {
  return map ? fmt::format(".{}_{}", map->agent_id, map->opened_utime) : std::string();
}
// `map`: empty for an agent's main map; `frame`: empty for the largest group.
inline std::string TrajectoryFile(int32_t agent_id, const std::optional<MapId>& map = {}) {
  return fmt::format("agent_{}{}.tum", agent_id, OfMap(map));
}
inline std::string OdometryFile(int32_t agent_id, const std::optional<MapId>& map = {}) {
  return fmt::format("agent_{}{}.vio.tum", agent_id, OfMap(map));
}
inline std::string PlyFile(const std::optional<MapId>& frame = {}) {
  return fmt::format("map{}.ply", OfMap(frame));
}
inline std::string TrajectoryPicture(const std::optional<MapId>& frame = {}) {
  return fmt::format("trajectory{}.png", OfMap(frame));
}
inline constexpr const char* kErrorPicture = "error.png";
inline constexpr const char* kAnchorPicture = "anchors.jpg";

}  // namespace pangea
