#pragma once

// The processes of a server, by the names under which they publish their status.

namespace pangea {

inline constexpr const char* kServerProcesses[] = {
    "agent_handler", "place_recognition", "inter_map_ba", "fusion",
    "posegraph",     "global_ba",         "map_points",   "anchors"};

}  // namespace pangea
