#pragma once

// One map's keyframes as the pose graph keeps them, and how far its odometry may have drifted
// between any two of them.
//
// In: keyframes of one map, ascending seq. Out: for nodes i and j the covariance of their relative
// pose by the odometry alone, in constant time: each edge's error, seen as a displacement of all
// that hangs on it, is a 4x4 form that adds up along the chain (prefix sums).

#include <cstdint>
#include <optional>
#include <vector>

#include "core/byte_record.h"
#include "core/keyframe.h"
#include "posegraph/solver/four_dof.h"

namespace pangea {

class OdometryChain {
 public:
  struct Node {
    int32_t seq = 0;
    int64_t utime = 0;
    Rigid3 T_odom_body;
    Eigen::Matrix2d roll_pitch_covariance;
    Eigen::Vector3d scene_odom;  // the middle of what it sees
    double scale_sigma = 0;      // Keyframe::scale_sigma
    int edge_from = -1;          // index of the node its odometry edge begins at; -1 for the first
    Relative4 edge;
    double path_m = 0;                      // travelled since the map's first keyframe
    Matrix4d drift_sum = Matrix4d::Zero();  // of all edges before, at the origin of odom
  };

  // False when it is there already or older than the newest. A keyframe without a usable edge is
  // joined to the one before it by a composite edge: the relative pose of the two odometry poses,
  // and the usual covariance of this map's edges for each keyframe that is missing.
  bool Add(const Keyframe& keyframe);

  void Save(ByteWriter* writer) const;
  // False if these are not the bytes of one.
  bool Restore(ByteReader* reader);

  size_t size() const { return nodes_.size(); }
  bool empty() const { return nodes_.empty(); }
  const Node& operator[](size_t index) const { return nodes_[index]; }
  std::optional<int> Find(int32_t seq) const;
  int num_bridged() const { return num_bridged_; }

  // Covariance, in the odom axes, of the displacement of `point_odom` (hanging on node j) relative
  // to node i.
  Matrix4d DriftBetween(int i, int j, const Eigen::Vector3d& point_odom) const;
  double PathBetween(int i, int j) const;
  double UnknownScale() const;  // sigma of the map's scale; 0 for a metric map

 private:
  void JoinByEdge(const OdometryEdge& edge, int from, Node* node) const;
  void Bridge(Node* node);
  void Accumulate(Node* node) const;

  // The one list of a node's parts, for writing and reading.
  template <typename NodeType, typename Visit>
  static void VisitParts(NodeType& node, const Visit& visit) {
    visit(&node.seq);
    visit(&node.utime);
    visit(&node.T_odom_body);
    visit(&node.roll_pitch_covariance);
    visit(&node.scene_odom);
    visit(&node.scale_sigma);
    visit(&node.edge_from);
    visit(&node.edge.t);
    visit(&node.edge.yaw);
    visit(&node.edge.covariance);
    visit(&node.path_m);
    visit(&node.drift_sum);
  }

  std::vector<Node> nodes_;
  int num_bridged_ = 0;
};

}  // namespace pangea
