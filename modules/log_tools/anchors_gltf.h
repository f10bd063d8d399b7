#pragma once

// Map points and anchors as glTF 2.0, one file with its buffer in it.
//
// glTF is y up, our map frame z up: (x, y, z) becomes (x, z, -y), for the points, the anchors'
// positions and their own axes. So what stands upright on an anchor here does so there.

#include <string>
#include <vector>

#include "log_tools/log_anchors.h"
#include "report/report_pictures.h"

namespace pangea::session {

// One map frame with what is in it.
struct GltfGroup {
  MapId frame;
  std::vector<ColouredPoint> points;
};

// One scene for each group, the first of `groups` the one to show: a node "map ID" whose children
// are its points (a point cloud with colours) and its placed anchors, each a node with its name,
// pose, and in `extras` id, payload (parsed where it is JSON) and sigma_m. A group that only
// anchors name has a scene too, after them. Throws std::runtime_error if there is nothing at all.
std::string ToGltf(const LoggedAnchors& logged, const std::vector<GltfGroup>& groups);

// Of a server bus' log. Throws std::runtime_error when the log has edits only.
void ExportGltf(const std::string& log, const LoggedAnchors& logged, const std::string& file,
                LogReadings* readings = nullptr);

}  // namespace pangea::session
