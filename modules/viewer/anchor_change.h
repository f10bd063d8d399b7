#pragma once

// A change of an anchor that somebody makes on a page, and the edit that follows from it.

#include <cstdint>
#include <optional>
#include <string>

#include "core/anchor.h"
#include "viewer/scene/scene.h"

namespace pangea::viewer {

struct AnchorChange {
  std::optional<AnchorId> anchor;  // nothing: a new anchor
  bool deleted = false;
  std::string name;      // only for a new anchor; at most kMaxAnchorName bytes
  int64_t keyframe = 0;  // index into Scene::keyframes(); unused if deleted
  Eigen::Vector3d p_body = Eigen::Vector3d::Zero();  // in that keyframe's body; unused if deleted
};

// The complete edit, as by a tool on the server, relative to the keyframe of the group nearest to
// the new position. A new anchor has the id (0, created_utime) and is upright; a moved one keeps
// its rotation. Nothing if there is no such anchor or keyframe.
std::optional<AnchorEdit> EditOf(const Scene& scene, const AnchorChange& change,
                                 int64_t created_utime);

}  // namespace pangea::viewer
