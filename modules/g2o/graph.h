#pragma once

// A graph of 6-DoF poses and relative measurements. Unlike the server's pose graph, whose keyframes
// keep the roll and pitch of their odometry, nothing in it knows the direction of gravity.

#include <cstdint>
#include <map>
#include <vector>

#include "core/rigid3.h"

namespace pangea {

struct GraphEdge {
  int64_t from = 0, to = 0;
  Rigid3 T_from_to;
  Matrix6d covariance = Matrix6d::Identity();  // of T_from_to
};

struct Graph {
  std::map<int64_t, Rigid3> vertices;  // T_map_body by number
  std::vector<int64_t> fixed;
  std::vector<GraphEdge> edges;
};

// The error of an edge, in the frame of `from` (metres, radians):
//
//   e = ( R_from^T (p_to - p_from) - t ;  2 vec(q_from^-1 q_to q^-1) )
//
// with the measurement (q, t). To first order it is T_from_to (-) measurement (core/rigid3.h); the
// quaternion's vector part, unlike an angle, has no jump at half a rotation.
Vector6d EdgeError(const GraphEdge& edge, const Rigid3& T_map_from, const Rigid3& T_map_to);

// Its Jacobians by the tangents of the two poses.
struct EdgeJacobians {
  Matrix6d from, to;
};
EdgeJacobians JacobiansOf(const GraphEdge& edge, const Rigid3& T_map_from, const Rigid3& T_map_to);

// Sum of the edges' e^T covariance^-1 e. Throws std::runtime_error that names an edge whose term is
// negative or not a number.
double Cost(const Graph& graph);

}  // namespace pangea
