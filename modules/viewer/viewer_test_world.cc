#include "viewer/viewer_test_world.h"

namespace pangea::viewer {

MapId TestMap(int32_t agent_id) { return {agent_id, 1'700'000'000'000'000}; }

ShownKeyframe TestKeyframe(const MapId& map, int32_t seq) {
  ShownKeyframe keyframe;
  keyframe.id = {map, seq};
  keyframe.utime = 1'000'000 * seq;
  keyframe.T_odom_body.t = Eigen::Vector3d(seq, 0, 0);
  keyframe.view = {-1, -0.75, 1, 0.75};
  keyframe.points = {{{0, 0, 2}, kNoLandmark}};
  return keyframe;
}

MapState TestState(const std::vector<MapId>& maps, int32_t highest_seq, int64_t revision) {
  MapState state;
  state.group = maps.front();
  state.revision = revision;
  state.maps = maps;
  for (size_t i = 0; i < maps.size(); ++i) {
    for (int32_t seq = 0; seq <= highest_seq; ++seq) {
      Rigid3 T_map_body;
      T_map_body.t = Eigen::Vector3d(seq, 10.0 * static_cast<double>(i), 0);
      state.keyframes.push_back({{maps[i], seq}, 1'000'000 * seq, T_map_body});
    }
  }
  return state;
}

Constraint TestConstraint(const KeyframeId& from, const KeyframeId& to, bool accepted) {
  Constraint constraint;
  constraint.from = from;
  constraint.to = to;
  constraint.accepted = accepted;
  constraint.reason = accepted ? "" : "12 inliers of 30 needed";
  constraint.num_inliers = accepted ? 80 : 12;
  return constraint;
}

AnchorState TestAnchor(int64_t n, const MapId& group) {
  AnchorState anchor;
  anchor.anchor = {1, n};
  anchor.revision = 1;
  anchor.edited_by = 1;
  anchor.name = "anchor " + std::to_string(n);
  anchor.map = anchor.group = group;
  anchor.T_odom_anchor.t.z() = static_cast<double>(n);
  anchor.covariance = 1e-4 * Matrix6d::Identity();
  return anchor;
}

}  // namespace pangea::viewer
