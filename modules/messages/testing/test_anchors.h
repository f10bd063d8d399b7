#pragma once

// Valid anchors for tests. The same arguments give the same anchor.

#include "messages/anchor_messages.h"

namespace pangea {

inline AnchorEdit TestEdit(const AnchorId& id, int64_t revision, int32_t agent_id) {
  AnchorEdit edit;
  edit.anchor = id;
  edit.revision = revision;
  edit.agent_id = agent_id;
  edit.name = "kettle " + ToString(id);
  edit.payload = R"({"colour": "red"})";
  edit.placement = AnchorEdit::Placement::kKeyframe;
  edit.map = {1, 1000};
  edit.keyframe_seq = 7;
  edit.T_ref_anchor = {ExpSo3({0.1, 0.2, static_cast<double>(revision % 100)}), {1, 2, 3}};
  edit.covariance = 1e-4 * Matrix6d::Identity();
  return edit;
}

inline AnchorState TestAnchor(const AnchorId& id, int64_t revision, const MapId& map,
                              const Eigen::Vector3d& t_odom_anchor = {1, 2, 3}) {
  AnchorState state;
  state.anchor = id;
  state.revision = revision;
  state.edited_by = id.agent_id;
  state.name = "kettle";
  state.map = state.group = map;
  state.T_odom_anchor = {ExpSo3({0.1, 0.2, 0.3}), t_odom_anchor};
  state.covariance = 1e-4 * Matrix6d::Identity();
  return state;
}

}  // namespace pangea
