#pragma once

// The maps of the pose graph: each one's odometry, and where the newest solution has its keyframes.
// A map has a number, in the order in which maps were first seen: the lower, the older.

#include <cmath>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <vector>

#include "core/byte_record.h"
#include "core/keyframe.h"
#include "posegraph/loop.h"
#include "posegraph/odometry_chain.h"
#include "posegraph/solver/four_dof.h"

namespace pangea {

struct GraphMap {
  MapId id;
  OdometryChain chain;
  std::vector<Pose4> poses;  // of each node, in the map frame
  Pose4 T_map_odom;
  double log_scale = 0;  // p_map = T_map_odom * (exp(log_scale) p_odom)
  int newest_solved = -1;
  Matrix4d covariance = Matrix4d::Zero();  // of T_map_odom
  // The oldest map of the group that it was last solved in; not in a checkpoint.
  int solved_with = 0;

  // Placed by odometry after the newest solution. False for a repeat and what is out of order.
  bool Add(const Keyframe& keyframe);

  double scale() const { return std::exp(log_scale); }
  // Where the newest solution has a node by odometry alone.
  Pose4 PoseOf(int node) const {
    return T_map_odom * Pose4{scale() * chain[node].T_odom_body.t, 0};
  }
  // The rigid transform that has the node, and what is near it, in its place.
  Pose4 RigidAt(int node) const {
    return {T_map_odom * Eigen::Vector3d((scale() - 1) * chain[node].T_odom_body.t),
            T_map_odom.yaw};
  }
  // All nodes from this one on are where odometry alone has them.
  void PlaceByOdometry(int first);
  // The whole map is displaced.
  void Move(const Pose4& T_map_before);
};

class GraphMaps {
 public:
  // The map's number: the next one if it is new.
  int Add(const MapId& id);

  std::optional<int> Number(const MapId& id) const;
  std::optional<NodeRef> Find(const KeyframeId& id) const;
  bool Contains(const NodeRef& node) const;

  size_t size() const { return maps_.size(); }
  GraphMap& operator[](int number) { return maps_[number]; }
  const GraphMap& operator[](int number) const { return maps_[number]; }
  auto begin() const { return maps_.begin(); }
  auto end() const { return maps_.end(); }

  template <typename Numbers>
  size_t NumKeyframes(const Numbers& numbers) const {
    size_t count = 0;
    for (const int number : numbers) {
      count += maps_[number].chain.size();
    }
    return count;
  }

  void Save(ByteWriter* writer) const;
  // Into an empty one; false if these are not the bytes of maps.
  bool Restore(ByteReader* reader);

 private:
  std::deque<GraphMap> maps_;  // which stay where they are: PairEvidence points to chains
  std::map<MapId, int> numbers_;
};

}  // namespace pangea
