#pragma once

// The keyframes of one map as the pose graph stores them, and the covariance of the odometry's
// drift between any two of them.
//
// Input: the keyframes of one map in ascending seq. Output: for nodes i and j the covariance of
// their relative pose from odometry alone, in constant time. The error of an edge displaces every
// node after it. Expressed at the origin of odom, the covariance of that displacement is a 4x4
// matrix, and those of successive edges add up: the chain stores prefix sums.

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
    Eigen::Vector3d scene_odom;             // the point on the optical axis at the median depth
    double scale_sigma = 0;                 // Keyframe::scale_sigma
    Relative4 edge;                         // from the node before it; none in the first node
    double path_m = 0;                      // travelled since the map's first keyframe
    Matrix4d drift_sum = Matrix4d::Zero();  // of all edges up to this node, at the origin of odom
  };

  // False if the keyframe is a repeat or older than the newest one. A keyframe without an edge from
  // its predecessor is joined to it by a composite edge: the relative pose of their two odometry
  // poses, with the mean covariance that this map's recent edges have per step of seq, once per
  // step.
  bool Add(const Keyframe& keyframe);

  void Save(ByteWriter* writer) const;
  // False if the bytes are not those of an OdometryChain.
  bool Restore(ByteReader* reader);

  size_t size() const { return nodes_.size(); }
  bool empty() const { return nodes_.empty(); }
  const Node& operator[](size_t index) const { return nodes_[index]; }
  std::optional<int> Find(int32_t seq) const;
  int num_bridged() const { return num_bridged_; }

  // Covariance of (x, y, z, yaw), in the odom axes: the displacement relative to node i of
  // `point_odom`, a point rigidly attached to node j.
  Matrix4d DriftBetween(int i, int j, const Eigen::Vector3d& point_odom) const;
  double PathBetween(int i, int j) const;
  double UnknownScale() const;  // sigma of the map's log-scale; 0: the map is metric

 private:
  void JoinByEdge(const OdometryEdge& edge, Node* node) const;
  void Bridge(Node* node);
  void Accumulate(Node* node) const;

  // Lists the members of a node once, for both Save and Restore.
  template <typename NodeType, typename Visit>
  static void VisitParts(NodeType& node, const Visit& visit) {
    visit(&node.seq);
    visit(&node.utime);
    visit(&node.T_odom_body);
    visit(&node.roll_pitch_covariance);
    visit(&node.scene_odom);
    visit(&node.scale_sigma);
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
