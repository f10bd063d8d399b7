#include "posegraph/odometry_chain.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/median.h"

namespace pangea {
namespace {

// Scene depth of a keyframe without points, metres: typical for a room.
constexpr double kUsualDepth = 3;

Eigen::Vector3d MiddleOfScene(const Keyframe& keyframe) {
  double depth = kUsualDepth;
  if (!keyframe.points.empty()) {
    std::vector<float> inverse_depths;
    for (const MapPoint& point : keyframe.points) {
      inverse_depths.push_back(point.inverse_depth);
    }
    depth = 1.0 / std::max(Median(std::move(inverse_depths)), 1e-3f);
  }
  return keyframe.T_odom_cam() * Eigen::Vector3d(0, 0, depth);
}

// An edge that knows less than this knows nothing. Beside larger variances, those of all later
// edges would vanish in the rounding of the sums.
Matrix4d Bounded(const Matrix4d& covariance) {
  constexpr double kMaxSigma_m = 100, kMaxSigmaYaw = 3.2;
  const Vector4d most(kMaxSigma_m, kMaxSigma_m, kMaxSigma_m, kMaxSigmaYaw);
  const Vector4d factor = most.cwiseQuotient(covariance.diagonal().cwiseSqrt()).cwiseMin(1);
  return factor.asDiagonal() * covariance * factor.asDiagonal();
}

// The errors of an edge's steps add up; on average, the yaw error of a step acts on half of them.
Eigen::Vector3d Lever(const Relative4& edge, int32_t steps) {
  return (steps > 1 ? 0.5 : 0.0) * edge.t;
}

}  // namespace

bool OdometryChain::Add(const Keyframe& keyframe) {
  if (!nodes_.empty() && keyframe.id.seq <= nodes_.back().seq) {
    return false;
  }
  Node node;
  node.seq = keyframe.id.seq;
  node.utime = keyframe.utime;
  node.T_odom_body = keyframe.T_odom_body;
  node.roll_pitch_covariance = keyframe.roll_pitch_covariance;
  node.scene_odom = MiddleOfScene(keyframe);
  node.scale_sigma = keyframe.scale_sigma;
  if (!nodes_.empty()) {
    if (keyframe.edge && keyframe.edge->from_seq == nodes_.back().seq) {
      JoinByEdge(*keyframe.edge, &node);
    } else {
      Bridge(&node);
    }
    Accumulate(&node);
  }
  nodes_.push_back(node);
  return true;
}

void OdometryChain::Save(ByteWriter* writer) const {
  writer->Put(num_bridged_);
  writer->PutCount(nodes_.size());
  for (const Node& node : nodes_) {
    VisitParts(node, [writer](const auto* part) { writer->Put(*part); });
  }
}

bool OdometryChain::Restore(ByteReader* reader) {
  constexpr size_t kMinBytes = 100;
  reader->Get(&num_bridged_);
  nodes_.resize(reader->GetCount(kMinBytes));
  for (Node& node : nodes_) {
    VisitParts(node, [reader](auto* part) { reader->Get(part); });
  }
  return reader->ok();
}

void OdometryChain::JoinByEdge(const OdometryEdge& edge, Node* node) const {
  const Node& from = nodes_.back();
  node->edge = MakeRelative4(edge.T_from_this, edge.covariance, from.T_odom_body.q,
                             from.roll_pitch_covariance, node->T_odom_body.q);
  node->edge.covariance = Bounded(node->edge.covariance);
}

void OdometryChain::Bridge(Node* node) {
  constexpr size_t kUsual = 50;
  Matrix4d usual = Vector4d(1e-4, 1e-4, 1e-4, 1e-4).asDiagonal();
  double steps = 1;
  for (size_t i = nodes_.size(); i > 1 && nodes_.size() - i < kUsual; --i) {
    const Relative4& edge = nodes_[i - 1].edge;
    const int32_t of_edge = nodes_[i - 1].seq - nodes_[i - 2].seq;
    usual += CovarianceAt(edge.covariance, -Lever(edge, of_edge));
    steps += of_edge;
  }
  const Node& from = nodes_.back();
  node->edge.t = node->T_odom_body.t - from.T_odom_body.t;
  node->edge.yaw = 0;
  const int32_t here = node->seq - from.seq;
  node->edge.covariance = CovarianceAt(usual * (here / steps), Lever(node->edge, here));
  ++num_bridged_;
}

void OdometryChain::Accumulate(Node* node) const {
  const Node& from = nodes_.back();
  node->path_m = from.path_m + node->edge.t.norm();
  // The edge's error moves a point P by dt + z x (P - p_to) dyaw; here P = 0, the origin of odom.
  node->drift_sum = from.drift_sum + CovarianceAt(node->edge.covariance, -node->T_odom_body.t);
}

std::optional<int> OdometryChain::Find(int32_t seq) const {
  const auto it = std::ranges::lower_bound(nodes_, seq, {}, &Node::seq);
  if (it == nodes_.end() || it->seq != seq) {
    return std::nullopt;
  }
  return static_cast<int>(it - nodes_.begin());
}

Matrix4d OdometryChain::DriftBetween(int i, int j, const Eigen::Vector3d& point_odom) const {
  const auto [first, last] = std::minmax(i, j);
  return CovarianceAt(nodes_[last].drift_sum - nodes_[first].drift_sum, point_odom);
}

double OdometryChain::PathBetween(int i, int j) const {
  return std::abs(nodes_[i].path_m - nodes_[j].path_m);
}

double OdometryChain::UnknownScale() const {
  std::vector<double> sigmas;
  for (const Node& node : nodes_) {
    sigmas.push_back(node.scale_sigma);
  }
  return UnknownScaleSigma(sigmas);
}

}  // namespace pangea
