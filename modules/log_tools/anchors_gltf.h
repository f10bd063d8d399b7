#pragma once

// Exports map points and anchors as glTF 2.0, in one file with embedded buffer.
//
// glTF is y-up, the map frame z-up: (x, y, z) becomes (x, z, -y), for points, positions of anchors,
// and the anchors' own axes. So an object that is upright on an anchor stays upright.

#include <string>
#include <vector>

#include "log_tools/log_anchors.h"
#include "report/report_pictures.h"

namespace pangea {

// One map frame with its points.
struct GltfGroup {
  MapId frame;
  std::vector<ColouredPoint> points;
};

// Makes one scene per group; the first of `groups` is the default scene. A scene has a node "map
// ID"; its children are a coloured point cloud and the placed anchors, each a node with name, pose,
// and in `extras` id, payload (parsed if it is JSON) and sigma_m. A group that only occurs in
// anchors also gets a scene, after the others. Throws std::runtime_error if there is nothing to
// export.
std::string ToGltf(const LoggedAnchors& logged, const std::vector<GltfGroup>& groups);

// Exports the log of a server bus. Throws std::runtime_error if the log has only edits.
void ExportGltf(const std::string& log, const LoggedAnchors& logged, const std::string& file,
                LogReadings* readings = nullptr);

}  // namespace pangea
