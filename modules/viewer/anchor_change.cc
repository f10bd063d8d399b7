#include "viewer/anchor_change.h"

#include <limits>

namespace pangea::viewer {
namespace {

// The nearest one of the group's keyframes that have arrived; at least the one named by the page.
const SceneKeyframe& NearestKeyframe(const Scene& scene, const MapId& group,
                                     const Eigen::Vector3d& p_map, const SceneKeyframe& named) {
  const SceneKeyframe* nearest = &named;
  double least = std::numeric_limits<double>::infinity();
  for (const SceneKeyframe& keyframe : scene.keyframes()) {
    if (!keyframe.arrived || scene.maps()[static_cast<size_t>(keyframe.map)].group != group) {
      continue;
    }
    const double distance = (scene.T_map_body(keyframe).t - p_map).squaredNorm();
    if (distance < least) {
      least = distance;
      nearest = &keyframe;
    }
  }
  return *nearest;
}

// The anchor's current rotation if it is known in this group's frame; else upright.
Eigen::Quaterniond RotationOf(const AnchorState* known, const MapId& group) {
  return known != nullptr && known->map == group ? known->T_odom_anchor.q
                                                 : Eigen::Quaterniond::Identity();
}

}  // namespace

std::optional<AnchorEdit> EditOf(const Scene& scene, const AnchorChange& change,
                                 int64_t created_utime) {
  AnchorEdit edit;
  edit.anchor = change.anchor.value_or(AnchorId{0, created_utime});
  edit.name = change.name;
  edit.deleted = change.deleted;
  const AnchorState* const known = scene.FindAnchor(edit.anchor);
  if (change.anchor) {
    if (known == nullptr) {
      return std::nullopt;
    }
    edit.revision = known->revision + 1;
    edit.name = NameOf(*known);
    edit.payload = known->payload;
  }
  if (change.deleted) {
    return edit;
  }
  if (change.keyframe < 0 || change.keyframe >= static_cast<int64_t>(scene.keyframes().size()) ||
      !scene.keyframes()[static_cast<size_t>(change.keyframe)].arrived) {
    return std::nullopt;
  }
  const SceneKeyframe& named = scene.keyframes()[static_cast<size_t>(change.keyframe)];
  const MapId group = scene.maps()[static_cast<size_t>(named.map)].group;
  const Rigid3 T_map_anchor(RotationOf(known, group), scene.T_map_body(named) * change.p_body);
  const SceneKeyframe& nearest = NearestKeyframe(scene, group, T_map_anchor.t, named);
  edit.placement = AnchorEdit::Placement::kKeyframe;
  edit.map = nearest.shown.id.map;
  edit.keyframe_seq = nearest.shown.id.seq;
  edit.utime = nearest.shown.utime;
  edit.T_ref_anchor = scene.T_map_body(nearest).Inverse() * T_map_anchor;
  return edit;
}

}  // namespace pangea::viewer
