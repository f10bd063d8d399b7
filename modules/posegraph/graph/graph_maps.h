#pragma once

// The maps of the pose graph: the odometry of each, and the poses of its keyframes in the newest
// solution. Maps are numbered in the order in which they were first seen: a lower number is an
// older map.

#include <cmath>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <vector>

#include "core/byte_record.h"
#include "core/keyframe.h"
#include "posegraph/graph/map_tags.h"
#include "posegraph/loop.h"
#include "posegraph/odometry_chain.h"
#include "posegraph/solver/four_dof.h"

namespace pangea {

struct GraphMap {
  MapId id;
  OdometryChain chain;
  MapTags tags;
  std::vector<Pose4> poses;  // of each node, in the map frame
  Pose4 T_map_odom;
  double log_scale = 0;  // p_map = T_map_odom * (exp(log_scale) p_odom)
  int newest_solved = -1;
  Matrix4d covariance = Matrix4d::Zero();  // of T_map_odom, (x, y, z, yaw)
  int64_t known_revision = 0;  // highest Keyframe::group_revision: the agent has this correction
  // Number of the oldest map of the group in which this map was last solved; not saved in a
  // checkpoint.
  int solved_with = 0;

  // Appends a node and places it by odometry after the newest solved one. False for a repeat, and
  // for a keyframe out of order.
  bool Add(const Keyframe& keyframe);

  double scale() const { return std::exp(log_scale); }
  // Pose of a node in the newest solution if odometry alone placed it.
  Pose4 PoseOf(int node) const {
    return T_map_odom * Pose4{scale() * chain[node].T_odom_body.t, 0};
  }
  // The rigid transform T_map_odom that is exact at this node; with log_scale = 0 it is the same
  // for all.
  Pose4 RigidAt(int node) const {
    return {T_map_odom * Eigen::Vector3d((scale() - 1) * chain[node].T_odom_body.t),
            T_map_odom.yaw};
  }
  // Places the nodes from `first` on by odometry alone.
  void PlaceByOdometry(int first);
  // Displaces the whole map, from frame "before" into the map frame.
  void Move(const Pose4& T_map_before);
};

class GraphMaps {
 public:
  // Returns the map's number; a new map gets the next one.
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
  // Call on an empty object. False if the bytes are not those of maps.
  bool Restore(ByteReader* reader);

 private:
  std::deque<GraphMap> maps_;  // a deque, because PairEvidence keeps pointers to the chains
  std::map<MapId, int> numbers_;
};

}  // namespace pangea
