#pragma once

// What somebody at a page wants of the anchors, and the edit that it makes.

#include <cstdint>
#include <optional>
#include <string>

#include "core/anchor.h"
#include "viewer/scene/scene.h"

namespace pangea::viewer {

struct AnchorChange {
  std::optional<AnchorId> anchor;  // which one; none: a new one
  bool deleted = false;
  std::string name;      // of a new one, at most kMaxAnchorName bytes
  int64_t keyframe = 0;  // index into Scene::keyframes(); this and below: not read when deleted
  Eigen::Vector3d p_body = Eigen::Vector3d::Zero();  // where to put it, in that keyframe's body
};

// As a tool on the server makes it: whole, relative to the keyframe of the group that is nearest to
// the place. A new one has the id (0, created_utime) and stands upright; one that is moved keeps
// its rotation. Nothing if there is no such anchor or keyframe.
std::optional<AnchorEdit> EditOf(const Scene& scene, const AnchorChange& change,
                                 int64_t created_utime);

}  // namespace pangea::viewer
