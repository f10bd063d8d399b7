#include "g2o/graph.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <stdexcept>

namespace pangea {
namespace {

// Rotation from the measurement to the estimate, in the frame of `from`; w >= 0.
Eigen::Quaterniond RotationError(const GraphEdge& edge, const Rigid3& T_map_from,
                                 const Rigid3& T_map_to) {
  Eigen::Quaterniond q = T_map_from.q.conjugate() * T_map_to.q * edge.T_from_to.q.conjugate();
  if (q.w() < 0) {
    q.coeffs() *= -1;
  }
  return q;
}

}  // namespace

Vector6d EdgeError(const GraphEdge& edge, const Rigid3& T_map_from, const Rigid3& T_map_to) {
  Vector6d error;
  error << T_map_from.q.conjugate() * (T_map_to.t - T_map_from.t) - edge.T_from_to.t,
      2 * RotationError(edge, T_map_from, T_map_to).vec();
  return error;
}

// With R = R_from^T, d = p_to - p_from, and the rotation's error (w, v): dp and dtheta are in the
// map frame, so the estimate's rotation becomes Exp(R (dtheta_to - dtheta_from)) (w, v), whose
// vector part changes by (w phi + phi x v) / 2 for a small phi.
EdgeJacobians JacobiansOf(const GraphEdge& edge, const Rigid3& T_map_from, const Rigid3& T_map_to) {
  const Eigen::Matrix3d R = T_map_from.q.conjugate().toRotationMatrix();
  const Eigen::Quaterniond error = RotationError(edge, T_map_from, T_map_to);
  const Eigen::Vector3d v = error.vec();
  EdgeJacobians J{Matrix6d::Zero(), Matrix6d::Zero()};
  J.to.topLeftCorner<3, 3>() = R;
  J.to.bottomRightCorner<3, 3>() = (error.w() * Eigen::Matrix3d::Identity() - Hat(v)) * R;
  J.from = -J.to;
  J.from.topRightCorner<3, 3>() = R * Hat(T_map_to.t - T_map_from.t);
  return J;
}

double Cost(const Graph& graph) {
  double cost = 0;
  for (const GraphEdge& edge : graph.edges) {
    const Vector6d error =
        EdgeError(edge, graph.vertices.at(edge.from), graph.vertices.at(edge.to));
    const double share = error.dot(edge.covariance.ldlt().solve(error));
    if (!std::isfinite(share) || share < 0) {
      throw std::runtime_error(
          fmt::format("the edge {} -> {} has the cost {}", edge.from, edge.to, share));
    }
    cost += share;
  }
  return cost;
}

}  // namespace pangea
