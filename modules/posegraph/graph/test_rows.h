#pragma once

// For tests of the pose graph's parts: maps whose keyframes stand in a row, one metre apart along
// x, and loops between them.

#include <vector>

#include "core/byte_record.h"
#include "posegraph/graph/graph_loops.h"
#include "posegraph/graph/graph_maps.h"

namespace pangea {

inline MapId RowId(int agent) { return {agent, 1000}; }

inline Keyframe InARow(const MapId& map, int seq) {
  Keyframe keyframe;
  keyframe.id = {map, seq};
  keyframe.utime = 1000 * seq;
  keyframe.T_odom_body.t = {static_cast<double>(seq), 0, 0};
  if (seq > 0) {
    keyframe.edge = OdometryEdge{
        seq - 1, {Eigen::Quaterniond::Identity(), {1, 0, 0}}, 1e-4 * Matrix6d::Identity()};
  }
  return keyframe;
}

// Map i belongs to agent i + 1.
inline GraphMaps MakeRows(int num_maps, int num_keyframes) {
  GraphMaps maps;
  for (int number = 0; number < num_maps; ++number) {
    maps.Add(RowId(number + 1));
    for (int seq = 0; seq < num_keyframes; ++seq) {
      maps[number].Add(InARow(RowId(number + 1), seq));
    }
  }
  return maps;
}

// Where map 1 stands in map 0.
inline const Pose4 kT_0_1{{2, -1, 0.5}, 0.3};

// The exact constraint if T is the pose of to's odom frame in from's odom frame.
inline Constraint MakeConstraint(const KeyframeId& from, const KeyframeId& to, const Pose4& T) {
  Constraint constraint;
  constraint.from = from;
  constraint.to = to;
  constraint.kind = from.map == to.map ? PlaceKind::kIntra : PlaceKind::kInter;
  constraint.accepted = true;
  constraint.T_from_to = InARow(from.map, from.seq).T_odom_body.Inverse() * T.ToRigid3() *
                         InARow(to.map, to.seq).T_odom_body;
  constraint.covariance = 1e-4 * Matrix6d::Identity();
  constraint.num_inliers = 60;
  return constraint;
}

inline Loop LoopBetween(NodeRef from, NodeRef to, const Pose4& T, const GraphMaps& maps) {
  return MakeLoop(MakeConstraint({maps[from.map].id, from.node}, {maps[to.map].id, to.node}, T),
                  from, to, maps);
}

// A derived loop: one alone suffices to merge its two maps.
inline Loop DerivedLoopBetween(NodeRef from, NodeRef to, const Pose4& T, const GraphMaps& maps) {
  Loop loop = LoopBetween(from, to, T, maps);
  loop.sufficient = true;
  return loop;
}

template <typename Part>
std::vector<uint8_t> BytesOf(const Part& part) {
  ByteRecordWriter writer;
  part.Save(&writer);
  return writer.Take();
}

}  // namespace pangea
